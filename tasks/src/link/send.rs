//! The sending task of a dock (paper, section 5): drives a [`Sender`] with the kernel's clock and a line.

use kernel::{Never, Task, now};

use super::cobs::WireBuffer;
use super::frame::{Frame, Label};
use super::port::{AtPort, Port};
use super::sender::{Departing, Sender};
use crate::device::Transmit;
use crate::message::Buffered;

/// After so many looks in a row that find the line busy, at most a tick apart, what comes in is no frame: the
/// longest takes 6 ms. Frames are sent into such noise, as on a free line. Else the messages that wait would
/// keep all buffers of the MCU for as long as it lasts.
const PATIENCE: u8 = 20;

/// Runs the sending task of `port`. `seed` should differ from dock to dock and from module to module.
pub fn run(task: &mut Task, port: &'static Port, line: impl Transmit, seed: u16) -> Never {
    let mut sender = Sender::new(seed);
    let mut line = Line { line, wire: Wire::new() };
    // When the alarm that is set rings.
    let mut alarm = None;
    let mut patience = PATIENCE;
    loop {
        port.mailbox().wait(task);
        let due = loop {
            let time = now(task);
            if !line.line.is_busy(task) {
                patience = PATIENCE;
            } else if patience > 0 {
                patience -= 1;
                break Some(time.wrapping_add(1));
            }
            match sender.poll(time, &mut AtPort { task, port }) {
                Some(frame) => line.transmit(task, frame),
                None => break sender.poll_at(),
            }
            sender.sent(now(task));
        };
        if due != alarm {
            match due {
                Some(time) => {
                    let left = time.wrapping_sub(now(task));
                    port.mailbox().wake_in(task, if left <= kernel::LONGEST { left } else { 0 });
                }
                None => port.mailbox().cancel_alarm(task),
            }
            alarm = due;
        }
    }
}

impl Departing for AtPort<'_> {
    type Letter = Buffered;

    fn take_ack_due(&mut self) -> Option<Label> {
        self.port.take_ack_due(self.task)
    }

    fn take_message(&mut self) -> Option<Buffered> {
        self.port.mailbox().take(self.task)
    }
}

/// The frame that went over a line last.
pub struct Wire {
    buffer: WireBuffer,
    /// The message whose frame is in the buffer.
    message: Option<Label>,
}

impl Wire {
    /// None yet.
    pub const fn new() -> Self {
        Wire { buffer: WireBuffer::new(), message: None }
    }

    /// Puts `frame` into the buffer, unless it is a repeated one, which is there already. Returns whether it
    /// is there.
    #[inline(always)] // its stack is that of `transmit`
    pub fn put(&mut self, frame: Frame) -> bool {
        let message = match frame {
            Frame::Data { label, .. } => Some(label),
            _ => None,
        };
        let is_there = message.is_some() && message == self.message;
        self.message = message;
        // The router passes on nothing that no frame can say. If it did, nothing would go out.
        is_there || frame.encode(&mut self.buffer).is_ok()
    }

    /// Its bytes for the line.
    #[inline(always)] // as `put`
    pub fn bytes(&self) -> &[u8] {
        self.buffer.bytes()
    }
}

impl Default for Wire {
    fn default() -> Self {
        Self::new()
    }
}

/// A line, and the frame that went over it last.
struct Line<Transmitter> {
    line: Transmitter,
    wire: Wire,
}

impl<Transmitter: Transmit> Line<Transmitter> {
    #[inline(never)] // keeps its stack frame out of the caller's
    fn transmit(&mut self, task: &mut Task, frame: Frame) {
        if self.wire.put(frame) {
            self.line.transmit(task, self.wire.bytes());
        }
    }
}
