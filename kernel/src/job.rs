//! Tasks that run to completion, many on one stack.

use core::ptr;

use crate::context::{Context, JobContext, Task};
use crate::group::{Group, StandIn};
use crate::semaphore::Semaphore;
use crate::task::{ControlBlock, Flag, Never};

/// What is done each time a semaphore has a signal. 10 bytes on the AVR, and no stack of its own.
///
/// ```
/// use kernel::{Job, JobContext, Semaphore};
/// static RECEIVED: Semaphore = Semaphore::new(0);
/// static ECHO: Job = Job::new(&RECEIVED, echo);
/// fn echo(job: &mut JobContext) { /* what takes short, and does not block */ }
/// ```
///
/// A job runs to its end before the next of its task begins; so it can't block, which its context sees to. Tasks of higher
/// priority preempt it.
#[repr(C)]
pub struct Job {
    /// First, so that its address is the job's.
    stand_in: StandIn,
    body: fn(&mut JobContext),
}

impl Job {
    /// Runs `body` for each signal of `signals`.
    pub const fn new(signals: &'static Semaphore, body: fn(&mut JobContext)) -> Job {
        Job { stand_in: StandIn::new(signals), body }
    }

    /// Waits for the next signal in the list of its semaphore; if there is one, behind the jobs that have theirs.
    fn wait(&'static self, task: &mut Task, group: &'static Group) {
        let StandIn { control, semaphore } = &self.stand_in;
        if !semaphore.enlist(task, control) {
            task.mask(|masked| group.append(masked, control));
        }
    }

    /// # Safety
    /// `stand_in` must be that of a job.
    unsafe fn of(stand_in: &'static ControlBlock) -> &'static Job {
        // SAFETY: the caller's promise; it is the first field, and `repr(C)` leaves it there.
        unsafe { &*ptr::from_ref(stand_in).cast() }
    }
}

/// One of the jobs is in the list of a task already, or twice in this one.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct JobTaken;

impl Task {
    /// Runs `jobs` for good, in the order of their signals.
    ///
    /// # Errors
    /// [`JobTaken`], before any has run.
    pub fn run_jobs(&mut self, jobs: &[&'static Job]) -> Result<Never, JobTaken> {
        let group = Group::new(self);
        // SAFETY: if jobs refer to it, this never returns, and a task for which others wait is not killed.
        let group: &'static Group = unsafe { &*ptr::from_ref(&group) };
        // First: a task that was killed in the midst of this would keep the jobs that it has taken.
        self.mask(|masked| group.task.set_flag(masked, Flag::Represented));
        let mut is_free = |job: &&'static Job| self.mask(|masked| group.claim(masked, &job.stand_in.control));
        if let Some(taken) = jobs.iter().position(|job| !is_free(job)) {
            for job in jobs.iter().take(taken) {
                self.mask(|masked| job.stand_in.control.forget(masked));
            }
            self.mask(|masked| group.task.clear_flag(masked, Flag::Represented));
            return Err(JobTaken);
        }
        jobs.iter().for_each(|job| job.wait(self, group));
        loop {
            // SAFETY: only jobs are in this group.
            let job = unsafe { Job::of(group.receive(self)) };
            (job.body)(&mut JobContext::new(self));
            job.wait(self, group);
        }
    }
}
