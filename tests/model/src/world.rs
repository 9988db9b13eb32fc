//! The kernel's objects, and the calls on them.

use core::array;

use kernel::{
    Boot, Context, Elapsed, EventFlags, Exhausted, Fifo, Full, Guard, Interrupt, Job, JobContext, JobTaken,
    Message, Mutex, Never, Period, Pipe, Pooled, Priority, Queue, Semaphore, Task, TaskHandle, TaskState,
    ThreadContext, Timer, now,
};
use serde::{Deserialize, Serialize};

use crate::call::{BUFFERS, Call, FIFO_BYTES, JOBS, Outcome, PIPE_BYTES};
use crate::parcel::Parcel;

/// Tasks of a world, at most; an MCU with little RAM has fewer.
pub const TASKS: usize = 6;
pub const SEMAPHORES: usize = 3;
pub const MUTEXES: usize = 2;
pub const QUEUES: usize = 2;
pub const TIMERS: usize = 3;
pub const JOBS_IN_ALL: usize = 4;

/// The initial values of the objects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Arrangement {
    /// The priority of each task.
    pub priorities: [u8; TASKS],
    /// How many tasks are started before the kernel runs.
    pub started: u8,
    /// The signals in store of each semaphore.
    pub semaphores: [u8; SEMAPHORES],
    /// The ceiling of each mutex, a priority.
    pub ceilings: [u8; MUTEXES],
    /// The room of each queue.
    pub rooms: [u8; QUEUES],
    /// The semaphore of each job.
    pub jobs: [u8; JOBS_IN_ALL],
}

#[allow(dead_code, reason = "an image without some calls has their objects all the same")]
pub struct World {
    mutexes: [Mutex<u8>; MUTEXES],
    tasks: &'static [TaskHandle],
    semaphores: &'static [Semaphore; SEMAPHORES],
    jobs: [Job; JOBS_IN_ALL],
    flags: EventFlags,
    queues: [Queue<Parcel>; QUEUES],
    fifo: Fifo<FIFO_BYTES>,
    pipe: Pipe<PIPE_BYTES>,
    timers: [Timer; TIMERS],
}

/// The values that a task keeps from call to call.
#[derive(Default)]
pub struct Belongings {
    made: Option<Message<Parcel>>,
    received: [Option<Message<Parcel>>; BUFFERS],
    period: Option<Period>,
}

/// The priority of this number, 0 to 7.
pub fn priority(number: u8) -> Priority {
    use Priority::*;
    match number {
        0 => P0,
        1 => P1,
        2 => P2,
        3 => P3,
        4 => P4,
        5 => P5,
        6 => P6,
        _ => P7,
    }
}

impl World {
    /// The semaphores of a world, which its jobs refer to.
    pub fn semaphores(arrangement: &Arrangement) -> [Semaphore; SEMAPHORES] {
        arrangement.semaphores.map(Semaphore::new)
    }

    /// The other objects. Job `n` runs `bodies[n]`.
    pub fn new(
        arrangement: &Arrangement,
        tasks: &'static [TaskHandle],
        semaphores: &'static [Semaphore; SEMAPHORES],
        bodies: [fn(&mut JobContext); JOBS_IN_ALL],
    ) -> Self {
        World {
            mutexes: arrangement.ceilings.map(|ceiling| Mutex::new(priority(ceiling), 0)),
            tasks,
            semaphores,
            jobs: array::from_fn(|job| {
                Job::new(&semaphores[usize::from(arrangement.jobs[job])], bodies[job])
            }),
            flags: EventFlags::new(),
            queues: arrangement.rooms.map(Queue::new),
            fifo: Fifo::new(),
            pipe: Pipe::new(),
            timers: array::from_fn(|_| Timer::new()),
        }
    }

    /// Only returns if one of the jobs is taken.
    pub fn run_jobs(&'static self, task: &mut Task, jobs: [usize; JOBS]) -> Result<Never, JobTaken> {
        task.run_jobs(&jobs.map(|job| &self.jobs[job]))
    }

    /// Makes a task's call that takes a mutex. Returns the guard, or the outcome if the call takes none.
    pub fn lock<'a>(&'static self, task: &'a mut Task, call: Call) -> Result<Guard<'a, u8>, Outcome> {
        match call {
            Call::Lock { mutex } => Ok(self.mutexes[mutex].lock(task)),
            Call::TryLock { mutex } => self.mutexes[mutex].try_lock(task).ok_or(Outcome::Truth(false)),
            Call::LockTimeout { mutex, ticks } => {
                self.mutexes[mutex].lock_timeout(task, ticks).map_err(|Elapsed| Outcome::Elapsed)
            }
            _ => unreachable!("it takes no mutex"),
        }
    }

    /// A task's call. It does not handle the calls that [lock](Self::lock) and `Unlock`, at which a guard's
    /// life begins and ends, nor `RunJobs`, `EndJob` and `Exit`, which may not return.
    #[inline(never)]
    pub fn call_of_task(&'static self, task: &mut Task, own: &mut Belongings, call: Call) -> Outcome {
        match call {
            Call::Wait { semaphore } => self.semaphores[semaphore].wait(task).into(),
            Call::WaitTimeout { semaphore, ticks } => {
                self.semaphores[semaphore].wait_timeout(task, ticks).into()
            }
            #[cfg(not(feature = "without-several"))]
            Call::WaitForSeveral { semaphores } => {
                let index = task.wait_any(semaphores.map(|semaphore| &self.semaphores[semaphore]));
                Outcome::Number(index as u16)
            }
            #[cfg(not(feature = "without-several"))]
            Call::WaitForSeveralTimeout { semaphores, ticks } => {
                let semaphores = semaphores.map(|semaphore| &self.semaphores[semaphore]);
                task.wait_any_timeout(semaphores, ticks).map(|index| index as u8).into()
            }
            #[cfg(not(feature = "without-several"))]
            Call::WaitAny(flags) => self.flags.wait_any(task, flags).into(),
            #[cfg(not(feature = "without-several"))]
            Call::WaitAll(flags) => self.flags.wait_all(task, flags).into(),
            #[cfg(not(feature = "without-several"))]
            Call::WaitAnyTimeout { flags, ticks } => self.flags.wait_any_timeout(task, flags, ticks).into(),
            #[cfg(not(feature = "without-several"))]
            Call::WaitAllTimeout { flags, ticks } => self.flags.wait_all_timeout(task, flags, ticks).into(),
            Call::Receive { queue } => own.keep(Some(self.queues[queue].receive(task))),
            Call::ReceiveTimeout { queue, ticks } => match self.queues[queue].receive_timeout(task, ticks) {
                Ok(message) => own.keep(Some(message)),
                Err(Elapsed) => Outcome::Elapsed,
            },
            #[cfg(not(feature = "without-bytes"))]
            Call::PipePut(byte) => self.pipe.put(task, byte).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipePutTimeout { byte, ticks } => self.pipe.put_timeout(task, byte, ticks).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipeTake => Some(self.pipe.take(task)).into(),
            #[cfg(not(feature = "without-bytes"))]
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

    /// A call of a job.
    #[inline(never)]
    pub fn call_of_job(&'static self, job: &mut JobContext, own: &mut Belongings, call: Call) -> Outcome {
        self.call_of_thread(job, own, call)
    }

    /// A call before there are tasks. It drops a received message at once.
    #[inline(never)]
    pub fn call_of_boot(&'static self, boot: &mut Boot, call: Call) -> Outcome {
        self.call_of_thread(boot, &mut Belongings::default(), call)
    }

    /// A call of a handler. It drops a received message at once.
    #[inline(never)]
    pub fn call_of_interrupt(&'static self, interrupt: &mut Interrupt, call: Call) -> Outcome {
        self.call_of_any(interrupt, &mut Belongings::default(), call)
    }

    /// A call that a task, a job and the code that starts the tasks may make.
    fn call_of_thread(
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
            Call::Suspend { task } => self.tasks[task].suspend(context).into(),
            Call::SetPriority { task, priority } => self.tasks[task].set_priority(context, priority).into(),
            Call::State { task } => Outcome::State(match self.tasks[task].state(context) {
                // A caller that starts the task frees its stack first.
                TaskState::Killed => TaskState::NotStarted,
                state => state,
            }),
            Call::Kill { task } => self.tasks[task].kill(context).into(),
            _ => self.call_of_any(context, own, call),
        }
    }

    /// A call that any context may make.
    fn call_of_any(&'static self, context: &mut impl Context, own: &mut Belongings, call: Call) -> Outcome {
        match call {
            Call::Post { semaphore } => self.semaphores[semaphore].post(context).into(),
            Call::TryWait { semaphore } => self.semaphores[semaphore].try_wait(context).into(),
            Call::Resume { task } => self.tasks[task].resume(context).into(),
            Call::Priority { task } => Outcome::Priority(self.tasks[task].priority(context)),
            #[cfg(not(feature = "without-several"))]
            Call::SetFlags(flags) => self.flags.set(context, flags).into(),
            #[cfg(not(feature = "without-several"))]
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
            #[cfg(not(feature = "without-bytes"))]
            Call::FifoPut(byte) => self.fifo.put(context, byte).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::FifoTake => self.fifo.take(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::FifoPeek => self.fifo.peek(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::FifoLength => self.fifo.length(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::FifoSpace => self.fifo.space(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::FifoFlush => self.fifo.flush(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::FifoOverruns => self.fifo.overruns(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipeTryPut(byte) => self.pipe.try_put(context, byte).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipeTryTake => self.pipe.try_take(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipePeek => self.pipe.peek(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipeLength => self.pipe.length(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipeSpace => self.pipe.space(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipeFlush => self.pipe.flush(context).into(),
            #[cfg(not(feature = "without-bytes"))]
            Call::PipeOverruns => self.pipe.overruns(context).into(),
            Call::TimerIsRunning { timer } => self.timers[timer].is_running(context).into(),
            Call::Now => now(context).into(),
            _ => unreachable!("not everybody can make this call"),
        }
    }
}

impl Belongings {
    pub fn drop_messages(&mut self) {
        self.made = None;
        self.received.iter_mut().for_each(|received| drop(received.take()));
    }

    fn keep(&mut self, message: Option<Message<Parcel>>) -> Outcome {
        let value = message.as_ref().map(|message| message.0);
        // There is a place for each buffer of the pool.
        if let Some(place) = self.received.iter_mut().find(|place| place.is_none()) {
            *place = message;
        }
        value.into()
    }
}
