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

/// Start bit, 8 data bits, stop bit.
pub(crate) const BITS: u64 = 10;

/// The levels of a character's bits.
pub(crate) fn levels(value: u8) -> impl Iterator<Item = bool> {
    let data = (0..8).map(move |bit| value & 1 << bit != 0);
    std::iter::once(false).chain(data).chain(std::iter::once(true))
}

impl Character {
    /// The cycle at which bit `number` begins; of [`BITS`], the character's end.
    pub(crate) fn bit(&self, number: u64) -> u64 {
        self.start + number * (self.end - self.start) / BITS
    }

    /// The cycles at which the line falls, and at which it rises.
    pub(crate) fn edges(&self) -> impl Iterator<Item = (u64, bool)> {
        let mut level = true;
        let edge =
            move |(number, next)| (std::mem::replace(&mut level, next) != next).then_some((number, next));
        (0..).zip(levels(self.value)).filter_map(edge).map(|(number, next)| (self.bit(number), next))
    }

    /// The level of the line at a cycle. An idle line is high.
    pub(crate) fn level(&self, at: u64) -> bool {
        let elapsed = at.checked_sub(self.start).filter(|_| at < self.end);
        let level_of = |bit: u64| levels(self.value).nth(bit as usize);
        elapsed.and_then(|cycles| level_of(cycles * BITS / (self.end - self.start))).unwrap_or(true)
    }

    /// The same character, `cycles` later.
    pub(crate) fn later(self, cycles: u64) -> Self {
        Self { start: self.start + cycles, end: self.end + cycles, ..self }
    }
}
