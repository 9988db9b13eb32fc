//! From the edges of a serial line to bytes: 8 data bits, no parity, 1 stop bit.
//!
//! An edge says how long the line had the level before, and so how many bits of that level there were. Timing begins
//! anew at each edge, so a sender may be off by a bit's half within the longest run of equal bits, which is 5 %.
//!
//! The tests on the host and the vectors run the same code.

use core::cell::Cell;

/// What has come.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Character {
    Byte(u8),
    /// The line was low in place of a stop bit.
    Malformed,
}

/// What an edge has brought.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Event {
    /// The character that has ended.
    pub ended: Option<Character>,
    /// Whether one begins.
    pub begins: bool,
}

impl Event {
    const NONE: Event = Event { ended: None, begins: false };
}

/// One line, of which a bit lasts `BIT` ticks of a clock with 16 bits.
///
/// Whoever drives it calls [`ended`](Self::ended) at the time that [`ends_at`](Self::ends_at) tells, if no other character has
/// begun by then.
pub struct EdgeDecoder<const BIT: u16> {
    /// When the last edge came; or where that began a character, when its start bit ends.
    last: Cell<u16>,
    /// When the character ends, and half a bit more.
    ends_at: Cell<u16>,
    /// What has come of the byte; ones above.
    byte: Cell<u8>,
    /// The bit of the byte that comes next; 0 when all have come.
    next: Cell<u8>,
    /// Whether a character is on the line.
    is_busy: Cell<bool>,
}

impl<const BIT: u16> EdgeDecoder<BIT> {
    /// A character has ended this long after it began, with half a bit to spare: a character that follows without a pause has
    /// begun by then.
    pub const END: u16 = 10 * BIT + BIT / 2;

    /// An idle line.
    pub const fn new() -> Self {
        EdgeDecoder {
            last: Cell::new(0),
            ends_at: Cell::new(0),
            byte: Cell::new(0),
            next: Cell::new(0),
            is_busy: Cell::new(false),
        }
    }

    /// At `time` the line changed to the level `is_high`.
    #[inline(always)]
    pub fn edge(&self, time: u16, is_high: bool) -> Event {
        if is_high { self.rise(time) } else { self.fall(time) }
    }

    /// At `time` the line went high: what was before were low bits.
    #[inline(always)]
    fn rise(&self, time: u16) -> Event {
        let last = self.last.replace(time);
        if !self.is_busy() {
            return Event::NONE;
        }
        let Some(mut left) = Self::steps(time, last) else {
            self.is_busy.set(false);
            // Too short for a start bit, or too long for any byte.
            let is_long = time.wrapping_sub(last).cast_signed() >= 0;
            return Event { ended: is_long.then_some(Character::Malformed), begins: false };
        };
        let (mut byte, mut next) = (self.byte.get(), self.next.get());
        while left >= Self::STEPS {
            left -= Self::STEPS;
            if next == 0 {
                self.is_busy.set(false);
                return Event { ended: Some(Character::Malformed), begins: false };
            }
            byte ^= next;
            next <<= 1;
        }
        self.byte.set(byte);
        self.next.set(next);
        Event::NONE
    }

    /// At `time` the line went low: what was before were high bits, the last of them perhaps a stop bit.
    #[inline(always)]
    fn fall(&self, time: u16) -> Event {
        if self.is_busy() {
            let mut next = self.next.get();
            if let Some(mut left) = Self::steps(time, self.last.get()) {
                let has_ended = loop {
                    if left < Self::STEPS {
                        break false;
                    }
                    if next == 0 {
                        break true;
                    }
                    left -= Self::STEPS;
                    next <<= 1;
                };
                if !has_ended {
                    self.last.set(time);
                    self.next.set(next);
                    return Event::NONE;
                }
            }
            return self.begin(time, Some(Character::Byte(self.byte.get())));
        }
        self.begin(time, None)
    }

    /// A bit in steps of 16 ticks: as many as a byte's bits take fit one byte, so that one subtraction counts a bit.
    const STEPS: u8 = {
        assert!(BIT >= 160 && BIT <= 430, "9 bits and a half must fit 256 steps, and a step be small beside a bit");
        ((BIT + 8) / 16) as u8
    };

    /// How long ago `last` was, and half a bit more, in steps; `None` if that is before, or ten bits ago.
    #[inline(always)]
    fn steps(time: u16, last: u16) -> Option<u8> {
        let ticks = time.wrapping_sub(last).wrapping_add(BIT / 2);
        if ticks >= 1 << 12 { None } else { Some((ticks >> 4) as u8) }
    }

    /// A character begins at `time`, `ended` before it.
    #[inline(always)]
    fn begin(&self, time: u16, ended: Option<Character>) -> Event {
        self.last.set(time.wrapping_add(BIT));
        self.ends_at.set(time.wrapping_add(Self::END));
        self.byte.set(0xff);
        self.next.set(1);
        self.is_busy.set(true);
        Event { ended, begins: true }
    }

    /// When the line changed to the level `is_high`, where nobody knows, but less than two bits after the edge before: a bit
    /// after.
    #[inline(always)]
    pub fn untimed(&self, is_high: bool) -> u16 {
        let last = self.last.get();
        let ends_start_bit = is_high && last == self.ends_at.get().wrapping_sub(Self::END - BIT);
        if ends_start_bit { last } else { last.wrapping_add(BIT) }
    }

    /// When to call [`ended`](Self::ended) for the character that has begun.
    #[inline(always)]
    pub fn ends_at(&self) -> u16 {
        self.ends_at.get()
    }

    /// The character that has ended; `is_high` is the level since the last edge.
    #[inline(always)]
    pub fn ended(&self, is_high: bool) -> Option<Character> {
        if !self.is_busy.replace(false) {
            return None;
        }
        Some(if is_high { Character::Byte(self.byte.get()) } else { Character::Malformed })
    }

    /// Whether a character is on the line.
    #[inline(always)]
    pub fn is_busy(&self) -> bool {
        self.is_busy.get()
    }

    /// Forgets what is on the line.
    pub fn reset(&self) {
        self.is_busy.set(false);
    }
}

impl<const BIT: u16> Default for EdgeDecoder<BIT> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
