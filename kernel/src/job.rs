//! Jobs: functions that run to completion, many on one stack.

use core::ptr;

use crate::arch;
use crate::context::{Context, JobContext, Never, Task};
use crate::control_block::ControlBlock;
use crate::semaphore::Semaphore;
use crate::wait::WaitOutcome;
use crate::wait_set::{ProxyWaiter, WaitSet};

/// A function that runs once for each signal of a semaphore. 10 bytes on the AVR, and no stack of its own.
///
/// ```
/// use kernel::{Job, JobContext, Semaphore};
/// static RECEIVED: Semaphore = Semaphore::new(0);
/// static ECHO: Job = Job::new(&RECEIVED, echo);
/// fn echo(job: &mut JobContext) { /* what takes short, and does not block */ }
/// ```
///
/// A job runs to its end before the next job of its task begins. So it must not block; its context has no
/// call that does. Tasks of higher priority preempt it.
#[repr(C)]
pub struct Job {
    /// First, so that its address is the job's.
    proxy: ProxyWaiter,
    body: fn(&mut JobContext),
}

impl Job {
    /// Runs `body` for each signal of `signals`.
    pub const fn new(signals: &'static Semaphore, body: fn(&mut JobContext)) -> Job {
        Job { proxy: ProxyWaiter::new(&signals.word), body }
    }

    /// Waits for the next signal in the queue of its semaphore. If there is a signal, the job goes behind
    /// those that have been given one already.
    fn wait(&'static self, task: &mut Task, set: &'static WaitSet) {
        let ProxyWaiter { control, word } = &self.proxy;
        ptr::from_ref(self).expose_provenance(); // for `of`
        if word.enter(task, control, None) != WaitOutcome::Blocked {
            task.mask(|masked| set.append(masked, control));
        }
    }

    /// # Safety
    /// `proxy` must be that of a job.
    unsafe fn of(proxy: &'static ControlBlock) -> &'static Job {
        // Not by a cast: a reference to a field does not lead to the whole.
        let job = ptr::with_exposed_provenance(ptr::from_ref(proxy).addr());
        // SAFETY: the caller guarantees that this is a job's proxy waiter; it is the first field, by
        // `repr(C)`. The job has been exposed, or its proxy waiter would not wait.
        unsafe { &*job }
    }
}

/// One of the jobs belongs to a task already, or is named twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JobTaken;

impl Task {
    /// Runs `jobs` forever, in the order of their signals.
    ///
    /// # Errors
    /// [`JobTaken`], before any has run.
    pub fn run_jobs(&mut self, jobs: &[&'static Job]) -> Result<Never, JobTaken> {
        let set = WaitSet::new(self);
        // SAFETY: once jobs refer to the wait set this never returns, and a task that runs jobs is not
        // killed.
        let set: &'static WaitSet = unsafe { &*ptr::from_ref(&set) };
        let mut is_free = |job: &&'static Job| self.mask(|masked| set.claim(masked, &job.proxy.control));
        if let Some(taken) = jobs.iter().position(|job| !is_free(job)) {
            for job in jobs.iter().take(taken) {
                self.mask(|masked| job.proxy.control.free(masked));
            }
            set.end(self);
            return Err(JobTaken);
        }
        let _clean_up = arch::when_dropped(|| {
            jobs.iter().for_each(|job| job.proxy.withdraw());
            set.withdraw();
        });
        jobs.iter().for_each(|job| job.wait(self, set));
        loop {
            let Some(signaled) = set.receive(self, |_| false) else { continue };
            // SAFETY: all members of this wait set are the proxy waiters of jobs.
            let job = unsafe { Job::of(signaled) };
            (job.body)(&mut JobContext::new(self));
            job.wait(self, set);
        }
    }
}
