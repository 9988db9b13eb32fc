//! From the edges of a serial line to bytes: 8 data bits, no parity, 1 stop bit.
//!
//! An edge says how long the line had the level before, and so how many bits of that level there were. Timing begins
//! anew at each edge, so a sender may be off by a bit's half within the longest run of equal bits, which is 5 %.
//!
//! On the robot the [vector](super::vectors) does what [`EdgeDecoder::edge`] does, on the same state; this is what it is held against,
//! and what decodes where edges were missed.

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
#[repr(C)]
#[derive(Clone, Copy)]
pub struct EdgeDecoder<const BIT: u16> {
    /// When the last edge came; or where that began a character, when its start bit ends.
    last: u16,
    /// When the character ends, and half a bit more.
    ends_at: u16,
    /// What has come of the byte; ones above.
    byte: u8,
    /// The bit of the byte that comes next; 0 when all have come.
    next: u8,
    /// Whether a character is on the line.
    is_busy: bool,
}

/// Offsets for the [vector](super::vectors).
#[doc(hidden)]
pub mod offset {
    use core::mem::offset_of;

    type Decoder = super::EdgeDecoder<0>;

    pub const LAST: usize = offset_of!(Decoder, last);
    pub const ENDS_AT: usize = offset_of!(Decoder, ends_at);
    pub const BYTE: usize = offset_of!(Decoder, byte);
    pub const NEXT: usize = offset_of!(Decoder, next);
    pub const IS_BUSY: usize = offset_of!(Decoder, is_busy);
}

impl<const BIT: u16> EdgeDecoder<BIT> {
    /// A character has ended this long after it began, with half a bit to spare: a character that follows without a pause has
    /// begun by then.
    pub const END: u16 = 10 * BIT + BIT / 2;

    /// An idle line.
    pub const fn new() -> Self {
        EdgeDecoder { last: 0, ends_at: 0, byte: 0, next: 0, is_busy: false }
    }

    /// At `time` the line changed to the level `is_high`.
    pub fn edge(&mut self, time: u16, is_high: bool) -> Event {
        // To the nearest bit.
        let mut left = time.wrapping_sub(self.last).wrapping_add(BIT / 2);
        self.last = time;
        if !self.is_busy {
            return if is_high { Event::NONE } else { self.begin(None) };
        }
        if is_high {
            if left.cast_signed() < 0 {
                self.is_busy = false; // too short for a start bit
                return Event::NONE;
            }
            while left >= BIT {
                if self.next == 0 {
                    self.is_busy = false;
                    return Event { ended: Some(Character::Malformed), begins: false };
                }
                self.byte ^= self.next;
                self.next <<= 1;
                left -= BIT;
            }
            return Event::NONE;
        }
        if time.wrapping_sub(self.ends_at.wrapping_sub(BIT)).cast_signed() >= 0 {
            return self.begin(Some(Character::Byte(self.byte)));
        }
        while left >= BIT {
            self.next <<= 1;
            left -= BIT;
        }
        Event::NONE
    }

    /// A character begins where the line went low, `ended` before it.
    fn begin(&mut self, ended: Option<Character>) -> Event {
        self.ends_at = self.last.wrapping_add(Self::END);
        self.last = self.last.wrapping_add(BIT);
        self.byte = 0xff;
        self.next = 1;
        self.is_busy = true;
        Event { ended, begins: true }
    }

    /// As [`edge`](Self::edge), where nobody knows when, but less than two bits after the edge before: it was a bit
    /// after.
    pub fn untimed_edge(&mut self, is_high: bool) -> Event {
        let ends_start_bit = is_high && self.last == self.ends_at.wrapping_sub(Self::END - BIT);
        self.edge(if ends_start_bit { self.last } else { self.last.wrapping_add(BIT) }, is_high)
    }

    /// When to call [`ended`](Self::ended) for the character that has begun.
    pub fn ends_at(&self) -> u16 {
        self.ends_at
    }

    /// The character that has ended; `is_high` is the level since the last edge.
    pub fn ended(&mut self, is_high: bool) -> Option<Character> {
        if !self.is_busy {
            return None;
        }
        self.is_busy = false;
        Some(if is_high { Character::Byte(self.byte) } else { Character::Malformed })
    }

    /// Whether a character is on the line.
    pub fn is_busy(&self) -> bool {
        self.is_busy
    }
}

impl<const BIT: u16> Default for EdgeDecoder<BIT> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
