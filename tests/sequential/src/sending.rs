//! The sending half of a dock's link, as turns of the loop; [`tasks::link::send`] runs it as a task.

use board::serial::{Beginner, Transmitter};
use kernel::{Task, Ticks, now};
use tasks::link::port::{AtPort, Port};
use tasks::link::send::Wire;
use tasks::link::sender::Sender;
use tasks::message::Buffered;

/// A dock's sender, and its line.
pub struct Sending {
    port: &'static Port,
    line: Beginner,
    sender: Sender<Buffered>,
    wire: Wire,
    phase: Phase,
    /// When to look again.
    at: Option<Ticks>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The line is free.
    Free,
    /// A frame is in the wire's buffer, and could not begin yet.
    Held,
    /// A frame is on the line.
    Leaving,
}

impl Sending {
    /// The sender of `port` on `line`; see [`tasks::link::send::run`] for `seed`.
    pub fn new(port: &'static Port, line: Transmitter, seed: u16) -> Self {
        let line = line.into_beginner();
        Sending { port, line, sender: Sender::new(seed), wire: Wire::new(), phase: Phase::Free, at: None }
    }

    /// Takes a turn. `is_sent`: the frame on the line has left. Returns the time of the next turn if nothing
    /// is posted before.
    #[inline(never)] // its stack is needed here alone
    pub fn turn(&mut self, task: &mut Task, is_sent: bool) -> Option<Ticks> {
        if self.phase == Phase::Leaving && is_sent {
            self.leave(task);
        }
        if self.phase == Phase::Free {
            self.choose(task);
        }
        if self.phase == Phase::Held {
            self.begin(task);
        }
        self.at
    }

    /// Notes that the frame has left the line.
    fn leave(&mut self, task: &mut Task) {
        self.sender.sent(now(task));
        self.phase = Phase::Free;
    }

    /// Chooses the next frame, or when to look again.
    fn choose(&mut self, task: &mut Task) {
        let time = now(task);
        if self.line.is_busy(task) {
            self.at = Some(time.wrapping_add(1));
            return;
        }
        match self.sender.poll(time, &mut AtPort { task, port: self.port }) {
            Some(frame) if self.wire.put(frame) => self.phase = Phase::Held,
            Some(_) => self.leave(task),
            None => self.at = self.sender.poll_at(),
        }
    }

    fn begin(&mut self, task: &mut Task) {
        // SAFETY: the bytes lie in the frame of `main`'s loop, which does not end and moves nothing. They are
        // left as they are, and nothing else begins, until `has_sent` has told and this phase is over.
        if unsafe { self.line.begin(task, self.wire.bytes()) } {
            self.phase = Phase::Leaving;
            self.at = None;
        } else {
            self.at = Some(now(task).wrapping_add(1));
        }
    }
}
