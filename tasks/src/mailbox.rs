//! A task's message queue (paper, section 4), and the one place where the task waits for anything.

use kernel::{Context, Full, Queue, Semaphore, Task, Ticks, Timer};

use crate::message::{Buffered, Letter};

/// A task's queue, and the semaphore that it waits on: for a message, a timer or whatever else is posted
/// there.
///
/// A task with several things to wait for looks at all of them each time it is woken; a wake-up for nothing
/// does no harm.
pub struct Mailbox {
    queue: Queue<Letter>,
    wake: Semaphore,
    timer: Timer,
}

impl Mailbox {
    /// An empty mailbox with room for `room` messages.
    pub const fn new(room: u8) -> Self {
        Mailbox { queue: Queue::new(room), wake: Semaphore::new(0), timer: Timer::new() }
    }

    /// Puts a message in, and wakes the task.
    ///
    /// # Errors
    /// [`Full`] with the message when there is no room.
    #[inline(never)]
    pub fn put(&self, context: &mut impl Context, letter: Buffered) -> Result<(), Full<Letter>> {
        self.queue.send(context, letter)?;
        self.wake(context);
        Ok(())
    }

    /// Takes the first message, if there is one.
    #[inline(never)] // this and the next stand in many places: 400 bytes of flash
    pub fn take(&self, task: &mut Task) -> Option<Buffered> {
        self.queue.try_receive(task)
    }

    /// Blocks until something is posted.
    #[inline(always)]
    pub fn wait(&self, task: &mut Task) {
        self.wake.wait(task);
    }

    /// Wakes the task.
    #[inline(never)]
    pub fn wake(&self, context: &mut impl Context) {
        self.wake.post(context);
    }

    /// What wakes the task: for devices and timers to post.
    pub const fn semaphore(&self) -> &Semaphore {
        &self.wake
    }

    /// Wakes the task in `ticks` ticks. One such alarm at a time: a new one replaces the one before.
    pub fn wake_in(&'static self, task: &mut Task, ticks: Ticks) {
        self.timer.start(task, ticks, &self.wake);
    }

    /// As [`wake_in`](Self::wake_in), unless an alarm is set already: that one stays.
    pub fn wake_within(&'static self, task: &mut Task, ticks: Ticks) {
        if !self.timer.is_running(task) {
            self.wake_in(task, ticks);
        }
    }

    /// Unsets the alarm, if there is one.
    pub fn cancel_alarm(&'static self, task: &mut Task) {
        self.timer.cancel(task);
    }

    /// Messages refused for want of room, up to 65,535.
    pub fn refused(&self, task: &mut Task) -> u16 {
        self.queue.refused(task)
    }
}
