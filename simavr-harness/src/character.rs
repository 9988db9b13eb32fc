//! The unit that travels over a wire between serial ports.

/// One byte on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Character {
    pub value: u8,
    /// Cycle at which the start bit begins.
    pub start: u64,
    /// Cycle at which the last stop bit ends.
    pub end: u64,
}

impl Character {
    /// The same character, `cycles` later.
    pub(crate) fn later(self, cycles: u64) -> Self {
        Self { start: self.start + cycles, end: self.end + cycles, ..self }
    }
}
