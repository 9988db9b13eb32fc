//! From the edges of a serial line to bytes: 8 data bits, no parity, 1 stop bit.
//!
//! An edge says how long the line had the level before, and so how many bits of that level there were. Timing begins
//! anew at each edge, so a sender may be off by a bit's half within the longest run of equal bits, which is 5 %.

/// What has come.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Character {
    Byte(u8),
    /// The line was low in place of a stop bit, or a character was lost before this one.
    Malformed,
}

/// The bits taken so far, the last of them on top. Below the first there is a one, which comes to the bottom when start
/// bit and data bits are there.
mod bits {
    /// None is taken.
    pub const NONE: u16 = TOP;
    /// Where the next one goes.
    pub const TOP: u16 = 1 << 9;
    /// Set when all are there.
    pub const ALL: u16 = 1;
    /// What the data bits are shifted by then: this bit, and the start bit.
    pub const DATA: u32 = 2;
    /// No character.
    pub const IDLE: u16 = 1 << 15 | ALL;
    /// A character without a stop bit: more bits were low than it has, and the one at the bottom is gone.
    pub const MALFORMED: u16 = 1 << 14 | ALL;
}

/// One line, of which a bit lasts `BIT` ticks of a clock with 16 bits.
///
/// Whoever drives it looks at [`ended`](Self::ended) when [`END`](Self::END) has passed since a character began.
#[derive(Clone, Copy)]
pub struct EdgeDecoder<const BIT: u16> {
    /// When the last edge came.
    last: u16,
    /// What has come of the character since.
    bits: u16,
    /// The character before, if it was not taken; else 0.
    ended: u16,
}

impl<const BIT: u16> EdgeDecoder<BIT> {
    /// A character has ended this long after it began: in the middle of its stop bit.
    pub const END: u16 = 9 * BIT + BIT / 2;

    /// An idle line.
    pub const fn new() -> Self {
        EdgeDecoder { last: 0, bits: bits::IDLE, ended: 0 }
    }

    /// At `time` the line changed to the level `is_high`. Returns when a character begins, if one does.
    #[inline(always)]
    pub fn edge(&mut self, time: u16, is_high: bool) -> Option<u16> {
        // To the nearest bit.
        let mut left = time.wrapping_sub(self.last).wrapping_add(BIT / 2);
        self.last = time;
        let mut bits = self.bits;
        if bits == bits::IDLE {
            return self.begin(is_high);
        }
        // Two loops, because each is short: this is most of an interrupt.
        if is_high {
            while left >= BIT {
                bits >>= 1;
                left -= BIT;
            }
            self.bits = match bits {
                bits::NONE => bits::IDLE, // too short for a start bit
                0 => bits::MALFORMED,
                bits => bits,
            };
            return None;
        }
        while left >= BIT && bits & bits::ALL == 0 {
            bits = bits >> 1 | bits::TOP;
            left -= BIT;
        }
        self.bits = bits;
        if bits & bits::ALL == 0 {
            return None;
        }
        self.ended = if self.ended == 0 { bits } else { bits::MALFORMED };
        self.begin(is_high)
    }

    /// A character begins where the line goes low.
    #[inline(always)]
    fn begin(&mut self, is_high: bool) -> Option<u16> {
        if is_high {
            return None;
        }
        self.bits = bits::NONE;
        Some(self.last)
    }

    /// As [`edge`](Self::edge), where nobody knows when, but less than two bits after the edge before: it was a bit
    /// after.
    #[inline(always)]
    pub fn untimed_edge(&mut self, is_high: bool) -> Option<u16> {
        self.edge(self.last.wrapping_add(BIT), is_high)
    }

    /// The character that has ended; `is_high` is the level since the last edge. Before it is the character that had
    /// ended already when the one on the line began.
    #[inline(always)]
    pub fn ended(&mut self, is_high: bool) -> Option<Character> {
        let mut ended = self.ended;
        self.ended = 0;
        if ended == 0 {
            if self.bits == bits::IDLE {
                return None;
            }
            let mut bits = self.bits;
            while bits & bits::ALL == 0 {
                bits = bits >> 1 | bits::TOP;
            }
            // A line that is low has no stop bit.
            ended = if is_high { bits } else { bits::MALFORMED };
            self.bits = bits::IDLE;
        }
        Some(if ended == bits::MALFORMED {
            Character::Malformed
        } else {
            Character::Byte((ended >> bits::DATA) as u8)
        })
    }

    /// Whether a character that has ended was not taken.
    #[inline(always)]
    pub fn is_behind(&self) -> bool {
        self.ended != 0
    }

    /// Whether a character is on the line.
    #[inline(always)]
    pub fn is_busy(&self) -> bool {
        self.bits != bits::IDLE
    }
}

impl<const BIT: u16> Default for EdgeDecoder<BIT> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
