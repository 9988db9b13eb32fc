//! From the edges of a serial line to bytes: 8 data bits, no parity, 1 stop bit.
//!
//! An edge says how long the line had the level before, and so how many bits of that level there were. Timing
//! begins anew at each edge, so a sender may be off by a bit's half within the longest run of equal bits,
//! which is 5 %.
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

/// A character begins.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Event {
    /// The character before it, if there was no pause.
    pub ended: Option<Character>,
}

/// What a run of low bits means.
enum Low {
    Bits {
        byte: u8,
        next: u8,
    },
    /// There was none: a pulse too short for a start bit.
    None,
    /// The stop bit was among them.
    TooMany,
}

/// One line, of which a bit lasts `BIT` ticks of a clock with 16 bits.
///
/// Whoever drives it calls [`ended`](Self::ended) at the time that [`ends_at`](Self::ends_at) tells, if no
/// other character has begun by then.
///
/// The work is done where the line goes low, for both runs of bits before: where it goes high, its time is
/// all there is to keep.
pub struct EdgeDecoder<const BIT: u16> {
    /// When the line went low; or where that began a character, when its start bit ends.
    fell: Cell<u16>,
    /// When the line went high.
    rose: Cell<u16>,
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
    /// A character has ended this long after it began, with half a bit to spare: a character that follows
    /// without a pause has begun by then.
    pub const END: u16 = 10 * BIT + BIT / 2;

    /// A bit in steps of 16 ticks: as many as a byte's bits take fit one byte, so that one subtraction counts
    /// a bit.
    const STEPS: u8 = {
        assert!(
            BIT >= 160 && BIT <= 430,
            "9 bits and a half must fit 256 steps, and a step be small beside a bit"
        );
        ((BIT + 8) / 16) as u8
    };

    /// An idle line.
    pub const fn new() -> Self {
        EdgeDecoder {
            fell: Cell::new(0),
            rose: Cell::new(0),
            ends_at: Cell::new(0),
            byte: Cell::new(0),
            next: Cell::new(0),
            is_busy: Cell::new(false),
        }
    }

    /// At `time` the line went high.
    #[inline(always)]
    pub fn rise(&self, time: u16) {
        self.rose.set(time);
    }

    /// At `time` the line went low. Returns the character that has ended, if a character begins by this.
    #[inline(always)]
    pub fn fall(&self, time: u16) -> Option<Event> {
        if !self.is_busy.get() {
            return self.begin(time, None);
        }
        let (byte, mut next) = match self.low_bits() {
            Low::Bits { byte, next } => (byte, next),
            Low::None => return self.begin(time, None),
            Low::TooMany => return self.begin(time, Some(Character::Malformed)),
        };
        // In the second half of the stop bit, or later. The high bits at the end of a byte need not be
        // counted.
        if time.wrapping_sub(self.ends_at.get()).wrapping_add(BIT).cast_signed() >= 0 {
            return self.begin(time, Some(Character::Byte(byte)));
        }
        let mut left = Self::steps(time, self.rose.get()).unwrap_or(0);
        while left >= Self::STEPS {
            left -= Self::STEPS;
            next <<= 1;
        }
        self.fell.set(time);
        self.byte.set(byte);
        self.next.set(next);
        None
    }

    /// What comes of the byte by the low bits before the line went high last.
    #[inline(always)]
    fn low_bits(&self) -> Low {
        let (mut byte, mut next) = (self.byte.get(), self.next.get());
        let Some(mut left) = Self::steps(self.rose.get(), self.fell.get()) else {
            // Too short for a start bit, or too long for any byte.
            let is_short = self.rose.get().wrapping_sub(self.fell.get()).cast_signed() < 0;
            return if is_short { Low::None } else { Low::TooMany };
        };
        while left >= Self::STEPS {
            if next == 0 {
                return Low::TooMany;
            }
            left -= Self::STEPS;
            byte ^= next;
            next <<= 1;
        }
        Low::Bits { byte, next }
    }

    /// From `from` to `to` and half a bit more, in steps; `None` if that is before, or ten bits after.
    #[inline(always)]
    fn steps(to: u16, from: u16) -> Option<u8> {
        let ticks = to.wrapping_sub(from).wrapping_add(BIT / 2);
        if ticks >= 1 << 12 { None } else { Some((ticks >> 4) as u8) }
    }

    /// A character begins at `time`, `ended` before it.
    #[inline(always)]
    fn begin(&self, time: u16, ended: Option<Character>) -> Option<Event> {
        self.fell.set(time.wrapping_add(BIT));
        self.ends_at.set(time.wrapping_add(Self::END));
        self.byte.set(0xff);
        self.next.set(1);
        self.is_busy.set(true);
        Some(Event { ended })
    }

    /// When the line went high, where nobody knows, but less than two bits after the edge before: a bit
    /// after.
    #[inline(always)]
    pub fn untimed_rise(&self) -> u16 {
        let fell = self.fell.get();
        let began = fell == self.ends_at.get().wrapping_sub(Self::END - BIT);
        if began { fell } else { fell.wrapping_add(BIT) }
    }

    /// The same, where it went low.
    #[inline(always)]
    pub fn untimed_fall(&self) -> u16 {
        self.rose.get().wrapping_add(BIT)
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
        if !is_high {
            return Some(Character::Malformed);
        }
        match self.low_bits() {
            Low::Bits { byte, .. } => Some(Character::Byte(byte)),
            Low::None => None,
            Low::TooMany => Some(Character::Malformed),
        }
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
