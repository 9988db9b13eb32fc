//! From the edges of a serial line to bytes: 8 data bits, no parity, 1 stop bit.
//!
//! An edge shows at which bit of its character the level changes. Time counts from the beginning of the
//! character, so a sender may be off by half a bit within nine and a half bits, which is 5 %.
//!
//! The tests on the host and the vectors run the same code.

use core::cell::Cell;

use kernel::flash;

use super::BIT;

/// A character that was received.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Character {
    Byte(u8),
    /// The line was low in place of a stop bit.
    Malformed,
}

/// The beginning of a character.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Event {
    /// The character before it, if there was no pause.
    pub ended: Option<Character>,
}

/// Ticks of a step: a character's first nine bits and a half take fewer than 256 steps.
const STEP: u16 = 16;

/// The first step of a character that is nearer to the end of its start bit than to the beginning.
const START: u8 = nearest(1);

/// The first step that is nearer to the end of its stop bit.
const STOP: u8 = nearest(10);

flash! {
    /// The bits of a byte that begin at a step of the character or later, as ones; the bits before them are
    /// zeros.
    static FROM: [u8; 256] = {
        let mut from = [0xff; 256];
        let mut bit = 1;
        while bit <= 8 {
            let mut step = nearest(bit + 1) as usize;
            while step < 256 {
                from[step] <<= 1;
                step += 1;
            }
            bit += 1;
        }
        from
    };
}

/// The first step whose middle is nearer to the beginning of bit `bit` of a character than to that of the bit
/// before.
const fn nearest(bit: u16) -> u8 {
    let step = (bit * BIT - BIT / 2 - STEP / 2).div_ceil(STEP);
    assert!(step <= 0xff, "what can be told apart of a character must fit the steps");
    step as u8
}

/// One line, on which a bit lasts [`BIT`] ticks of a 16-bit clock.
///
/// Its driver calls [`ended`](Self::ended) at the time that [`ends_at`](Self::ends_at) returns, if no other
/// character has begun by then.
///
/// The work is done when the line goes low, for both runs of bits before. When it goes high, only its time
/// has to be stored.
pub struct EdgeDecoder {
    /// When the character began.
    began: Cell<u16>,
    /// When the line went low.
    fell: Cell<u16>,
    /// When the line went high.
    rose: Cell<u16>,
    /// The byte, if the line stays low from `fell` on.
    byte: Cell<u8>,
    /// Whether a character is on the line.
    is_busy: Cell<bool>,
}

impl EdgeDecoder {
    /// The time from a character's beginning to its end, with half a bit to spare: a character that follows
    /// without a pause has begun by then.
    pub const END: u16 = 10 * BIT + BIT / 2;

    /// An idle line.
    pub const fn new() -> Self {
        EdgeDecoder {
            began: Cell::new(0),
            fell: Cell::new(0),
            rose: Cell::new(0),
            byte: Cell::new(0),
            is_busy: Cell::new(false),
        }
    }

    /// At `time` the line went high.
    #[inline(always)]
    pub fn rise(&self, time: u16) {
        self.rose.set(time);
    }

    /// At `time` the line went low. If this begins a character, returns the one that has ended.
    #[inline(always)]
    pub fn fall(&self, time: u16) -> Option<Event> {
        if !self.is_busy.get() {
            return self.begin(time, None);
        }
        match (self.high(), self.step(time)) {
            (Some(Character::Byte(byte)), Some(step)) => {
                self.fell.set(time);
                self.byte.set(byte & !Self::bits_from(step));
                None
            }
            (ended, _) => self.begin(time, ended),
        }
    }

    /// The character, if the line has stayed high since its last rise. There is none if the line had been low
    /// for less than half a start bit.
    #[inline(always)]
    fn high(&self) -> Option<Character> {
        match self.step(self.rose.get()) {
            None => Some(Character::Malformed),
            Some(step) if step < START => None,
            Some(step) => Some(Character::Byte(self.byte.get() | Self::bits_from(step))),
        }
    }

    /// The step of the character at `time`; `None` from the second half of its stop bit on.
    #[inline(always)]
    fn step(&self, time: u16) -> Option<u8> {
        let ticks = time.wrapping_sub(self.began.get());
        if ticks >= STOP as u16 * STEP { None } else { Some((ticks / STEP) as u8) }
    }

    #[inline(always)]
    fn bits_from(step: u8) -> u8 {
        FROM.get(step.into()).unwrap_or(0)
    }

    /// Begins a character at `time`; `ended` is the one before it.
    #[inline(always)]
    fn begin(&self, time: u16, ended: Option<Character>) -> Option<Event> {
        self.began.set(time);
        self.fell.set(time);
        self.byte.set(0);
        self.is_busy.set(true);
        Some(Event { ended })
    }

    /// The time of a rise that was not captured, but came less than two bits after the edge before: a bit
    /// after that edge.
    #[inline(always)]
    pub fn untimed_rise(&self) -> u16 {
        self.fell.get().wrapping_add(BIT)
    }

    /// The same for a fall.
    #[inline(always)]
    pub fn untimed_fall(&self) -> u16 {
        self.rose.get().wrapping_add(BIT)
    }

    /// When to call [`ended`](Self::ended) for the character that has begun.
    #[inline(always)]
    pub fn ends_at(&self) -> u16 {
        self.began.get().wrapping_add(Self::END)
    }

    /// The character that has ended; `is_high` is the level since the last edge.
    #[inline(always)]
    pub fn ended(&self, is_high: bool) -> Option<Character> {
        if !self.is_busy.replace(false) {
            return None;
        }
        if is_high { self.high() } else { Some(Character::Malformed) }
    }

    /// Whether a character is on the line.
    #[inline(always)]
    pub fn is_busy(&self) -> bool {
        self.is_busy.get()
    }

    /// Forgets the character on the line.
    pub fn reset(&self) {
        self.is_busy.set(false);
    }
}

impl Default for EdgeDecoder {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
