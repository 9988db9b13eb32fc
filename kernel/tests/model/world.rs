//! The kernel's own objects, and the calls made on them.

use std::cell::Cell;

use kernel::{
    Context, EventFlags, Exhausted, Fifo, Full, Message, Mutex, Period, Pool, Pooled, Queue, Refused,
    Semaphore, Slot, Stack, Task, Timer, now,
};

use crate::call::{BUFFERS, Call, FIFO_BYTES, Outcome, Setup};

pub struct Parcel(u8);

std::thread_local! {
    /// Each world has a pool of its own.
    static POOL: Cell<Option<&'static Pool<Parcel>>> = const { Cell::new(None) };
}

impl Pooled for Parcel {
    fn pool() -> &'static Pool<Self> {
        POOL.get().expect("a world was made")
    }
}

pub struct World {
    pub tasks: Vec<Stack<0>>,
    pub mutexes: Vec<Mutex<u8>>,
    /// Where each task waits that has left.
    pub returns: Vec<Semaphore>,
    semaphores: Vec<Semaphore>,
    flags: EventFlags,
    queues: Vec<Queue<Parcel>>,
    fifo: Fifo<FIFO_BYTES>,
    timers: Vec<Timer>,
}

/// What a task keeps from call to call.
#[derive(Default)]
pub struct Belongings {
    made: Option<Message<Parcel>>,
    received: Vec<Message<Parcel>>,
    period: Option<Period>,
}

impl World {
    /// The objects are the kernel's for ever, as statics are. So this is a few hundred bytes that stay.
    pub fn new(setup: &Setup) -> &'static Self {
        let buffers: &[Slot<Parcel>] = Box::leak(Box::new([const { Slot::new() }; BUFFERS]));
        POOL.set(Some(Box::leak(Box::new(Pool::new(buffers)))));
        Box::leak(Box::new(World {
            tasks: setup.priorities.iter().map(|_| Stack::new()).collect(),
            mutexes: setup.ceilings.iter().map(|&ceiling| Mutex::new(ceiling, 0)).collect(),
            returns: setup.priorities.iter().map(|_| Semaphore::new(0)).collect(),
            semaphores: setup.semaphores.iter().map(|&signals| Semaphore::new(signals)).collect(),
            flags: EventFlags::new(),
            queues: setup.rooms.iter().map(|&room| Queue::new(room)).collect(),
            fifo: Fifo::new(),
            timers: (0..setup.timers).map(|_| Timer::new()).collect(),
        }))
    }

    /// A task's call. `Lock` and `Unlock` are not among them: they are the two ends of a guard's life;
    /// nor is `Exit`, which has no outcome.
    pub fn call_of_task(&'static self, task: &mut Task, own: &mut Belongings, call: Call) -> Outcome {
        match call {
            Call::Wait { semaphore } => {
                self.semaphores[semaphore].wait(task);
                Outcome::Nothing
            }
            Call::WaitTimeout { semaphore, ticks } => {
                match self.semaphores[semaphore].wait_timeout(task, ticks) {
                    Ok(()) => Outcome::Nothing,
                    Err(kernel::Elapsed) => Outcome::Elapsed,
                }
            }
            Call::WaitAny(flags) => Outcome::Number(self.flags.wait_any(task, flags).into()),
            Call::WaitAll(flags) => {
                self.flags.wait_all(task, flags);
                Outcome::Nothing
            }
            Call::Make { value } => match Message::new(task, Parcel(value)) {
                Ok(message) => {
                    own.made = Some(message);
                    Outcome::Nothing
                }
                Err(Exhausted(_)) => Outcome::Exhausted,
            },
            Call::SendMade { queue } => {
                let message = own.made.take().expect("the reference permits it only then");
                match self.queues[queue].send(task, message) {
                    Ok(()) => Outcome::Nothing,
                    Err(Full(message)) => {
                        own.made = Some(message);
                        Outcome::Full
                    }
                }
            }
            Call::Receive { queue } => own.keep(Some(self.queues[queue].receive(task))),
            Call::ReceiveTimeout { queue, ticks } => match self.queues[queue].receive_timeout(task, ticks) {
                Ok(message) => own.keep(Some(message)),
                Err(kernel::Elapsed) => Outcome::Elapsed,
            },
            Call::StartTimer { timer, ticks, semaphore } => {
                self.timers[timer].start(task, ticks, &self.semaphores[semaphore]);
                Outcome::Nothing
            }
            Call::CancelTimer { timer } => Outcome::Truth(self.timers[timer].cancel(task)),
            Call::Yield => {
                task.yield_now();
                Outcome::Nothing
            }
            Call::Suspend { task: other } => of_refusal(self.tasks[other].task().suspend(task)),
            Call::SetPriority { task: other, priority } => {
                of_refusal(self.tasks[other].task().set_priority(task, priority))
            }
            Call::State { task: other } => Outcome::State(self.tasks[other].task().state(task)),
            Call::Kill { task: other } => of_refusal(self.tasks[other].task().kill(task)),
            Call::Delay(ticks) => {
                task.delay(ticks);
                Outcome::Nothing
            }
            Call::DelayUntil(deadline) => Outcome::Truth(task.delay_until(deadline)),
            Call::StartPeriod(length) => {
                own.period = Some(Period::new(task, length));
                Outcome::Nothing
            }
            Call::WaitForPeriod => {
                let period = own.period.as_mut().expect("the reference permits it only then");
                period.wait(task);
                Outcome::Number(period.missed())
            }
            _ => self.call(task, own, call),
        }
    }

    /// A task's call or an interrupt's.
    pub fn call(&'static self, context: &mut impl Context, own: &mut Belongings, call: Call) -> Outcome {
        match call {
            Call::Post { semaphore } => {
                self.semaphores[semaphore].post(context);
                Outcome::Nothing
            }
            Call::Resume { task } => Outcome::Truth(self.tasks[task].task().resume(context)),
            Call::TryWait { semaphore } => Outcome::Truth(self.semaphores[semaphore].try_wait(context)),
            Call::SetFlags(flags) => {
                self.flags.set(context, flags);
                Outcome::Nothing
            }
            Call::TakeFlags(flags) => Outcome::Number(self.flags.take(context, flags).into()),
            Call::Send { queue, value } => match Message::new(context, Parcel(value)) {
                Ok(message) => match self.queues[queue].send(context, message) {
                    Ok(()) => Outcome::Nothing,
                    Err(Full(_)) => Outcome::Full,
                },
                Err(Exhausted(_)) => Outcome::Exhausted,
            },
            Call::TryReceive { queue } => own.keep(self.queues[queue].try_receive(context)),
            Call::DropMessages => {
                own.made = None;
                own.received.clear();
                Outcome::Nothing
            }
            Call::Refused { queue } => Outcome::Number(self.queues[queue].refused(context)),
            Call::PoolMostUsed => Outcome::Number(Parcel::pool().most_used(context).into()),
            Call::PoolExhausted => Outcome::Number(Parcel::pool().exhausted(context)),
            Call::Put(byte) => Outcome::Byte(self.fifo.put(context, byte)),
            Call::Take => Outcome::Byte(self.fifo.take(context)),
            Call::Overruns => Outcome::Number(self.fifo.overruns(context)),
            Call::Now => Outcome::Number(now(context)),
            _ => unreachable!("a task only can make {call:?}"),
        }
    }

    /// A call for everything that an interrupt can find out.
    pub fn all_observations(&self) -> Vec<Call> {
        let semaphores = (0..self.semaphores.len()).map(|semaphore| Call::TryWait { semaphore });
        let queues =
            (0..self.queues.len()).flat_map(|queue| [Call::TryReceive { queue }, Call::Refused { queue }]);
        let others = [
            Call::TakeFlags(0xff),
            Call::Take,
            Call::Overruns,
            Call::PoolMostUsed,
            Call::PoolExhausted,
            Call::Now,
        ];
        semaphores.chain(queues).chain(others).collect()
    }
}

fn of_refusal(result: Result<(), Refused>) -> Outcome {
    result.map_or_else(Outcome::Refused, |()| Outcome::Nothing)
}

impl Belongings {
    fn keep(&mut self, message: Option<Message<Parcel>>) -> Outcome {
        let value = message.as_ref().map(|message| message.0);
        self.received.extend(message);
        Outcome::Byte(value)
    }
}
