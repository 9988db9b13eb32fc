//! What the system tasks ask of their devices. The board implements it.

use kernel::Task;

/// The sending half of a dock's serial link.
pub trait Transmit {
    /// Whether a frame is coming in. The line is half duplex, so to send now would be to drown it.
    fn is_busy(&self, task: &mut Task) -> bool;

    /// Sends `bytes`, and blocks until the last stop bit is on the wire. What comes in meanwhile may be lost.
    fn transmit(&mut self, task: &mut Task, bytes: &[u8]);
}

/// The receiving half of a dock's serial link.
pub trait Receive {
    /// Blocks until the zero byte that ends a frame has come, and copies the frame, that zero
    /// included, to the start of `buffer`. Returns its length in bytes.
    ///
    /// A frame whose end was lost ends when the next one begins.
    ///
    /// A frame that does not fit is dropped up to its zero, and counted in
    /// [`overruns`](Self::overruns), as are bytes that the hardware or the FIFO lost.
    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> usize;

    /// How many bytes and frames were lost on the way in: up to 65,535, where it stays.
    fn overruns(&self, task: &mut Task) -> u16;
}

/// How a transfer over the bus between the MCUs ended.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Transfer {
    /// The other MCU acknowledged every byte.
    Done,
    /// The other MCU did not acknowledge its address or a byte: it is off, in reset or its buffer is full.
    Refused,
    /// The bus was in a state that the protocol does not know.
    Fault,
}

/// The bus between the two MCUs of a module. Either may start a transfer; a lost arbitration is
/// tried again when the bus is free, without the task's doing.
///
/// After a transfer has ended, or one from the other MCU has come in whole, the board posts the
/// semaphore that it was given for this.
pub trait Bus {
    /// Starts to send `bytes`, at most 24. One transfer at a time: the one before must have an outcome.
    fn send(&mut self, task: &mut Task, bytes: &[u8]);

    /// Starts to send once more what was sent last.
    fn send_again(&mut self, task: &mut Task);

    /// Frees the bus, on which a transfer has taken too long: something may hold it, or this side may take it for busy
    /// when it is not. The transfer has no outcome. Spends a quarter of a millisecond.
    fn free(&mut self, task: &mut Task);

    /// The outcome of the transfer that was started last, once.
    fn outcome(&mut self, task: &mut Task) -> Option<Transfer>;

    /// Copies what came from the other MCU to the start of `buffer`, and returns its length, once.
    /// Until then further transfers from there are refused.
    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> Option<usize>;
}
