//! The local timer of Table 1: it runs from 0 to Period, over and over, from power-up.
//!
//! It runs whatever the module's type. A head whose link flickers goes on in the same beat, and a
//! module that takes itself for a head for a moment, while it discovers one neighbour before the
//! other, does not beat at once.

use core::num::NonZeroU16;

/// A point within the Period, in 256ths of it.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Phase(pub u8);

impl Phase {
    /// Timer 0.
    pub const START: Phase = Phase(0);
    /// Timer 0.5 · Period.
    pub const HALF: Phase = Phase(128);

    /// Milliseconds from the start of a Period of `period` milliseconds.
    fn offset(self, period: NonZeroU16) -> u16 {
        // In two halves, for a product of 24 bits is dear on the AVR.
        let [low, high] = period.get().to_le_bytes().map(u16::from);
        let phase = u16::from(self.0);
        high * phase + ((low * phase) >> 8)
    }
}

/// A timer with a Period.
pub struct LocalTimer {
    period: NonZeroU16,
    read_at: u16,
    /// Where in the Period the last reading fell.
    position: u16,
    /// How far the last reading was from the one before.
    step: u16,
}

impl LocalTimer {
    /// A timer that is at 0 at `now`. `period` is in milliseconds, at most 32 767.
    pub const fn new(period: NonZeroU16, now: u16) -> Self {
        LocalTimer { period, read_at: now, position: 0, step: 0 }
    }

    /// Reads the clock.
    pub fn advance(&mut self, now: u16) {
        self.step = now.wrapping_sub(self.read_at);
        self.read_at = now;
        self.position = self.position.wrapping_add(self.step % self.period) % self.period;
    }

    /// Whether the timer came by `phase` between the last two readings, this one included.
    pub fn passed(&self, phase: Phase) -> bool {
        self.distance(phase.offset(self.period), self.position) < self.step
    }

    /// Milliseconds from the last reading until the timer comes by `phase` again; at least 1.
    pub fn until(&self, phase: Phase) -> u16 {
        match self.distance(self.position, phase.offset(self.period)) {
            0 => self.period.get(),
            distance => distance,
        }
    }

    /// The clock at the last reading.
    pub fn read_at(&self) -> u16 {
        self.read_at
    }

    /// From one position forward to another, round the end of the Period if need be.
    fn distance(&self, from: u16, to: u16) -> u16 {
        if to >= from { to - from } else { self.period.get() - from + to }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: NonZeroU16 = NonZeroU16::new(1000).unwrap();

    #[test]
    fn the_offset_is_the_phase_in_256ths_of_the_period() {
        for period in [1, 255, 256, 1000, 32_767, 65_535] {
            for phase in 0..=u8::MAX {
                let offset = Phase(phase).offset(NonZeroU16::new(period).unwrap());
                assert_eq!(u32::from(offset), u32::from(period) * u32::from(phase) / 256);
            }
        }
    }

    #[test]
    fn a_phase_is_passed_once_a_period_however_the_clock_is_read() {
        for stride in [1_u32, 7, 33, 250, 499] {
            let start = 65_000_u16;
            let mut timer = LocalTimer::new(PERIOD, start);
            let mut passed = Vec::new();
            for elapsed in (stride..=70_000).step_by(stride as usize) {
                timer.advance(start.wrapping_add(elapsed as u16));
                for phase in [Phase::START, Phase::HALF] {
                    if timer.passed(phase) {
                        passed.push((elapsed, phase));
                    }
                }
            }
            assert_eq!(passed.len() as u32, (70_000 / stride * stride) / 500);
            for (number, (elapsed, phase)) in (1_u32..).zip(passed) {
                assert!(
                    (number * 500..number * 500 + stride).contains(&elapsed),
                    "{elapsed} with stride {stride}"
                );
                assert_eq!(phase, if number % 2 == 0 { Phase::START } else { Phase::HALF });
            }
        }
    }

    #[test]
    fn until_leads_to_the_reading_that_passes() {
        let mut timer = LocalTimer::new(PERIOD, 0);
        assert_eq!(timer.until(Phase::HALF), 500);
        assert_eq!(timer.until(Phase::START), 1000);
        timer.advance(499);
        assert!(!timer.passed(Phase::HALF));
        assert_eq!(timer.until(Phase::HALF), 1);
        timer.advance(500);
        assert!(timer.passed(Phase::HALF));
        assert_eq!(timer.until(Phase::HALF), 1000);
        assert_eq!(timer.until(Phase::START), 500);
    }

    #[test]
    fn a_reading_with_no_time_between_passes_nothing() {
        let mut timer = LocalTimer::new(PERIOD, 0);
        timer.advance(500);
        timer.advance(500);
        assert!(!timer.passed(Phase::HALF));
    }

    #[test]
    fn the_position_is_right_after_a_minute_without_a_reading() {
        let mut timer = LocalTimer::new(PERIOD, 0);
        timer.advance(900);
        timer.advance(900_u16.wrapping_add(65_000));
        assert_eq!(timer.until(Phase::START), 100);
    }

    #[test]
    fn the_longest_period_does_not_overflow() {
        let longest = NonZeroU16::new(32_767).unwrap();
        let mut timer = LocalTimer::new(longest, 0);
        timer.advance(32_766);
        timer.advance(32_766 + 32_766);
        assert_eq!(timer.until(Phase::START), 2);
    }
}
