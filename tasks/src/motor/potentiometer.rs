//! From the converter's reading of a joint's potentiometer to a position.

use super::{Position, TENTH};
use crate::sensor::Scale;

/// A working potentiometer gives no reading below this, nor one as near to full scale: a broken wire or a
/// short pulls the wiper to an end of the scale, and a joint's mechanical stops lie inside.
const MARGIN: u16 = 24;

/// The converter's full scale.
const FULL_SCALE: u16 = 1023;

/// How a potentiometer sits on its shaft.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Potentiometer {
    zero: i16,
    scale: i16,
}

impl Potentiometer {
    /// One that begins to read `zero` (0 to 1023) at 0 degrees, and whose position changes by `scale` for
    /// each count.
    ///
    /// Panics, when it is evaluated as a constant, if a position would not fit its type.
    pub const fn new(zero: u16, scale: i16) -> Self {
        let span = if zero > FULL_SCALE / 2 { zero } else { FULL_SCALE - zero };
        assert!(zero <= FULL_SCALE && scale > 0, "no such potentiometer");
        assert!((span as i32 + 1) * scale as i32 <= Position::MAX as i32, "positions do not fit 16 bits");
        Potentiometer { zero: zero as i16, scale }
    }

    /// How much the position changes from one reading to the next.
    pub const fn resolution(&self) -> Position {
        self.scale
    }

    /// The scale of its readings as those of a sensor, in 0.1 degree.
    pub const fn sensor(&self) -> Scale {
        Scale { zero: self.zero, slope: self.scale * 64 / TENTH }
    }

    /// The position at this reading; `None` if no working potentiometer gives it.
    pub fn position(&self, reading: u16) -> Option<Position> {
        if !(MARGIN..=FULL_SCALE - MARGIN).contains(&reading) {
            return None;
        }
        // The product fits 16 bits, as `new` has made sure. The converter rounds down, so the middle of the
        // range that gives this reading is half a count higher. A shift halves the scale: the compiler does
        // not know that the scale is above 0.
        Some((reading as i16).wrapping_sub(self.zero).wrapping_mul(self.scale).wrapping_add(self.scale >> 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reading_is_its_position_or_a_fault() {
        for (zero, scale) in [(512, 47), (0, 31), (1023, 31), (300, 1)] {
            let potentiometer = Potentiometer::new(zero, scale);
            for reading in 0..=u16::MAX {
                let expected =
                    (i32::from(reading) - i32::from(zero)) * i32::from(scale) + i32::from(scale / 2);
                let is_fault = !(24..=999).contains(&reading);
                assert_eq!(potentiometer.position(reading).map(i32::from), (!is_fault).then_some(expected));
            }
        }
    }
}
