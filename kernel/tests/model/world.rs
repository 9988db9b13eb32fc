//! The kernel's own objects, and the calls made on them.

use std::cell::Cell;
use std::ptr;

use kernel::{
    Context, Elapsed, EventFlags, Exhausted, Fifo, Full, Job, JobTaken, Message, Mutex, Never, Period, Pipe,
    Pool, Pooled, Queue, Semaphore, Slot, Stack, Task, ThreadContext, Timer, now,
};

use crate::call::{BUFFERS, Call, FIFO_BYTES, JOBS, Outcome, PIPE_BYTES, Setup};
use crate::jobs::BODIES;

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
    semaphores: &'static [Semaphore],
    jobs: Vec<Job>,
    flags: EventFlags,
    queues: Vec<Queue<Parcel>>,
    fifo: Fifo<FIFO_BYTES>,
    pipe: Pipe<PIPE_BYTES>,
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
        let semaphores: &[Semaphore] =
            setup.semaphores.iter().map(|&signals| Semaphore::new(signals)).collect::<Vec<_>>().leak();
        let jobs = setup.jobs.iter().zip(BODIES);
        Box::leak(Box::new(World {
            tasks: setup.priorities.iter().map(|_| Stack::new()).collect(),
            mutexes: setup.ceilings.iter().map(|&ceiling| Mutex::new(ceiling, 0)).collect(),
            returns: setup.priorities.iter().map(|_| Semaphore::new(0)).collect(),
            semaphores,
            jobs: jobs.map(|(&semaphore, body)| Job::new(&semaphores[semaphore], body)).collect(),
            flags: EventFlags::new(),
            queues: setup.rooms.iter().map(|&room| Queue::new(room)).collect(),
            fifo: Fifo::new(),
            pipe: Pipe::new(),
            timers: (0..setup.timers).map(|_| Timer::new()).collect(),
        }))
    }

    /// The running task.
    pub fn running(&self, context: &mut impl Context) -> usize {
        let address = context.mask(kernel::running);
        let is_running = |stack: &Stack<0>| ptr::from_ref(stack).addr() == address;
        self.tasks.iter().position(is_running).expect("a task runs")
    }

    /// Only returns if one of the jobs is taken.
    pub fn run_jobs(&'static self, task: &mut Task, jobs: [usize; JOBS]) -> Result<Never, JobTaken> {
        task.run_jobs(&jobs.map(|job| &self.jobs[job]))
    }

    /// A task's call. `Lock` and `Unlock` are not among them: they are the two ends of a guard's life;
    /// nor are `RunJobs`, `EndJob` and `Exit`, which may not return.
    pub fn call_of_task(&'static self, task: &mut Task, own: &mut Belongings, call: Call) -> Outcome {
        match call {
            Call::Wait { semaphore } => self.semaphores[semaphore].wait(task).into(),
            Call::WaitTimeout { semaphore, ticks } => {
                self.semaphores[semaphore].wait_timeout(task, ticks).into()
            }
            Call::WaitForSeveral { semaphores } => {
                let index = task.wait_any(semaphores.map(|semaphore| &self.semaphores[semaphore]));
                Outcome::Number(index as u16)
            }
            Call::WaitAny(flags) => self.flags.wait_any(task, flags).into(),
            Call::WaitAll(flags) => self.flags.wait_all(task, flags).into(),
            Call::Receive { queue } => own.keep(Some(self.queues[queue].receive(task))),
            Call::ReceiveTimeout { queue, ticks } => match self.queues[queue].receive_timeout(task, ticks) {
                Ok(message) => own.keep(Some(message)),
                Err(Elapsed) => Outcome::Elapsed,
            },
            Call::PipePut(byte) => self.pipe.put(task, byte).into(),
            Call::PipePutTimeout { byte, ticks } => self.pipe.put_timeout(task, byte, ticks).into(),
            Call::PipeTake => Some(self.pipe.take(task)).into(),
            Call::PipeTakeTimeout { ticks } => match self.pipe.take_timeout(task, ticks) {
                Ok(byte) => Some(byte).into(),
                Err(Elapsed) => Outcome::Elapsed,
            },
            Call::Yield => task.yield_now().into(),
            Call::Delay(ticks) => task.delay(ticks).into(),
            Call::DelayUntil(deadline) => task.delay_until(deadline).into(),
            Call::StartPeriod(length) => {
                own.period = Some(Period::new(task, length));
                Outcome::Nothing
            }
            Call::WaitForPeriod => {
                let period = own.period.as_mut().expect("the reference permits it only then");
                period.wait(task);
                period.missed().into()
            }
            _ => self.call_of_thread(task, own, call),
        }
    }

    /// A call of a task, of a job, or before there are any.
    pub fn call_of_thread(
        &'static self,
        context: &mut impl ThreadContext,
        own: &mut Belongings,
        call: Call,
    ) -> Outcome {
        match call {
            Call::Make { value } => match Message::new(context, Parcel(value)) {
                Ok(message) => {
                    own.made = Some(message);
                    Outcome::Nothing
                }
                Err(Exhausted(_)) => Outcome::Exhausted,
            },
            Call::SendMade { queue } => {
                let message = own.made.take().expect("the reference permits it only then");
                match self.queues[queue].send(context, message) {
                    Ok(()) => Outcome::Nothing,
                    Err(Full(message)) => {
                        own.made = Some(message);
                        Outcome::Full
                    }
                }
            }
            Call::DropMessages => own.drop_messages().into(),
            Call::StartTimer { timer, ticks, semaphore } => {
                self.timers[timer].start(context, ticks, &self.semaphores[semaphore]).into()
            }
            Call::CancelTimer { timer } => self.timers[timer].cancel(context).into(),
            Call::Suspend { task } => self.tasks[task].task().suspend(context).into(),
            Call::SetPriority { task, priority } => {
                self.tasks[task].task().set_priority(context, priority).into()
            }
            Call::State { task } => Outcome::State(self.tasks[task].task().state(context)),
            Call::Kill { task } => self.tasks[task].task().kill(context).into(),
            _ => self.call(context, own, call),
        }
    }

    /// Anybody's call.
    pub fn call(&'static self, context: &mut impl Context, own: &mut Belongings, call: Call) -> Outcome {
        match call {
            Call::Post { semaphore } => self.semaphores[semaphore].post(context).into(),
            Call::TryWait { semaphore } => self.semaphores[semaphore].try_wait(context).into(),
            Call::Resume { task } => self.tasks[task].task().resume(context).into(),
            Call::Priority { task } => Outcome::Priority(self.tasks[task].task().priority(context)),
            Call::SetFlags(flags) => self.flags.set(context, flags).into(),
            Call::TakeFlags(flags) => self.flags.take(context, flags).into(),
            Call::Send { queue, value } => match Message::new(context, Parcel(value)) {
                Ok(message) => match self.queues[queue].send(context, message) {
                    Ok(()) => Outcome::Nothing,
                    Err(Full(_)) => Outcome::Full,
                },
                Err(Exhausted(_)) => Outcome::Exhausted,
            },
            Call::TryReceive { queue } => own.keep(self.queues[queue].try_receive(context)),
            Call::Refused { queue } => self.queues[queue].refused(context).into(),
            Call::PoolMostUsed => Parcel::pool().most_used(context).into(),
            Call::PoolExhausted => Parcel::pool().exhausted(context).into(),
            Call::FifoPut(byte) => self.fifo.put(context, byte).into(),
            Call::FifoTake => self.fifo.take(context).into(),
            Call::FifoPeek => self.fifo.peek(context).into(),
            Call::FifoLength => self.fifo.length(context).into(),
            Call::FifoSpace => self.fifo.space(context).into(),
            Call::FifoFlush => self.fifo.flush(context).into(),
            Call::FifoOverruns => self.fifo.overruns(context).into(),
            Call::PipeTryPut(byte) => self.pipe.try_put(context, byte).into(),
            Call::PipeTryTake => self.pipe.try_take(context).into(),
            Call::PipePeek => self.pipe.peek(context).into(),
            Call::PipeLength => self.pipe.length(context).into(),
            Call::PipeSpace => self.pipe.space(context).into(),
            Call::PipeFlush => self.pipe.flush(context).into(),
            Call::PipeOverruns => self.pipe.overruns(context).into(),
            Call::TimerIsRunning { timer } => self.timers[timer].is_running(context).into(),
            Call::Now => now(context).into(),
            _ => unreachable!("not everybody can make {call:?}"),
        }
    }

    /// A call for everything that an interrupt can find out.
    pub fn all_observations(&self) -> Vec<Call> {
        let semaphores = (0..self.semaphores.len()).map(|semaphore| Call::TryWait { semaphore });
        let queues =
            (0..self.queues.len()).flat_map(|queue| [Call::TryReceive { queue }, Call::Refused { queue }]);
        let tasks = (0..self.tasks.len()).map(|task| Call::Priority { task });
        let timers = (0..self.timers.len()).map(|timer| Call::TimerIsRunning { timer });
        let others = [
            Call::TakeFlags(0xff),
            Call::FifoTake,
            Call::FifoOverruns,
            Call::PipeTryTake,
            Call::PipeOverruns,
            Call::PoolMostUsed,
            Call::PoolExhausted,
            Call::Now,
        ];
        semaphores.chain(queues).chain(tasks).chain(timers).chain(others).collect()
    }
}

impl Belongings {
    pub fn drop_messages(&mut self) {
        self.made = None;
        self.received.clear();
    }

    fn keep(&mut self, message: Option<Message<Parcel>>) -> Outcome {
        let value = message.as_ref().map(|message| message.0);
        self.received.extend(message);
        value.into()
    }
}
