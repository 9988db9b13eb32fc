//! A task's message queue (paper, section 4), and the one place where the task waits for anything.

use kernel::{Context, Full, Queue, Semaphore, Task, Ticks, Timer};

use crate::message::{Buffered, Letter};

/// A task's queue, and the semaphore that it waits on: for a message, a timer or any other signal that is
/// posted there.
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
    /// [`Full`] with the message when there is no room beside what its [kind](crate::message::Kind::leaves)
    /// leaves to others.
    #[inline(never)]
    pub fn put(&self, context: &mut impl Context, letter: Buffered) -> Result<(), Full<Letter>> {
        self.queue.send_leaving(letter.kind().leaves(), context, letter)?;
        self.wake(context);
        Ok(())
    }

    /// Takes the first message, if there is one.
    #[inline(never)] // this and the next are called in many places: saves 400 bytes of flash
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

    /// The semaphore that wakes the task: for devices and timers to post.
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
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::message::{Address, Kind, Message, TaskCode};
    use kernel::{Priority, Stack, host, now};
    use std::sync::Mutex;
    use std::vec::Vec;

    /// Runs `body` as a task, for so many ticks, and lets it rest behind its end.
    fn run_for(ticks: u32, stack: &'static Stack<96>, body: fn(&mut Task)) {
        host::run_for(
            ticks,
            |boot| {
                stack
                    .start(boot, Priority::P0, move |task| {
                        body(task);
                        loop {
                            task.delay(kernel::LONGEST);
                        }
                    })
                    .expect("the stack is free");
            },
            |_, _| {},
        );
    }

    #[test]
    fn datagrams_leave_a_place_to_what_is_said_once() {
        static MAILBOX: Mailbox = Mailbox::new(3);
        static STACK: Stack<96> = Stack::new();
        static TAKEN: Mutex<Vec<Kind>> = Mutex::new(Vec::new());
        run_for(1, &STACK, |task| {
            let here = Address::here(TaskCode::HORMONE);
            for kind in [Kind::Datagram, Kind::Datagram, Kind::Datagram, Kind::Latest, Kind::Lasting] {
                let message = Message::of_kind(here, here, &[], kind).expect("it is short");
                let letter = kernel::Message::new(task, Letter::of(message));
                let _ = MAILBOX.put(task, letter.expect("there is a buffer"));
            }
            while let Some(letter) = MAILBOX.take(task) {
                TAKEN.lock().expect("no test panicked with it").push(letter.kind());
            }
        });
        let taken = TAKEN.lock().expect("no test panicked with it");
        assert_eq!(*taken, [Kind::Datagram, Kind::Datagram, Kind::Latest]);
    }

    #[test]
    fn an_alarm_wakes_the_task_unless_it_is_unset_and_a_second_one_does_not_put_it_off() {
        static MAILBOX: Mailbox = Mailbox::new(0);
        static STACK: Stack<96> = Stack::new();
        static WOKEN: Mutex<Vec<Ticks>> = Mutex::new(Vec::new());
        run_for(100, &STACK, |task| {
            let note = |task: &mut Task| {
                MAILBOX.wait(task);
                WOKEN.lock().expect("no test panicked with it").push(now(task));
            };
            MAILBOX.wake_in(task, 10);
            MAILBOX.wake_within(task, 20); // the first stays
            note(task);
            MAILBOX.wake_within(task, 20); // there is none
            note(task);
            MAILBOX.wake_in(task, 10);
            MAILBOX.wake_in(task, 40); // takes its place
            note(task);
            MAILBOX.wake_in(task, 10);
            MAILBOX.cancel_alarm(task);
            note(task); // never
        });
        assert_eq!(*WOKEN.lock().expect("no test panicked with it"), [10, 30, 70]);
    }
}
