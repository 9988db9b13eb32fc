//! Random delay before a repetition.
//!
//! On a half-duplex medium two ends that collided once and repeat after the same time-out collide for ever.
//! So each adds a few milliseconds of its own.

use crate::lfsr;

/// The longest delay, in milliseconds. Of two ends that begin a millisecond apart the later one hears the
/// other and waits, so a few milliseconds suffice. Where light is bad, messages wait for nothing else as
/// long.
pub const LONGEST: u8 = 3;

const _: () = assert!((LONGEST + 1).is_power_of_two(), "all delays are equally frequent");

/// The delays of one dock, by a [shift register](lfsr).
pub struct Backoff(u16);

impl Backoff {
    /// `seed` should differ from dock to dock and from module to module.
    pub const fn new(seed: u16) -> Backoff {
        // Zero is the one state that the register never leaves.
        Backoff(if seed == 0 { 1 } else { seed })
    }

    /// The delay to add before the next repetition or datagram, 0..=[`LONGEST`] ms.
    pub fn next_ms(&mut self) -> u8 {
        // More shifts than bits are taken, so that no bit is used twice, and a number that has no
        // factor in common with the period, so that every state has its turn.
        self.0 = lfsr::shifted::<4>(self.0);
        self.0 as u8 & LONGEST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_delays_are_equally_frequent_over_the_period() {
        let mut backoff = Backoff::new(0);
        let mut counts = [0_u16; LONGEST as usize + 1];
        for _ in 0..65535_u16 {
            counts[usize::from(backoff.next_ms())] += 1;
        }
        assert_eq!(backoff.0, 1, "the register is back where it began");
        // Every state but zero.
        assert_eq!(counts, [16_383, 16_384, 16_384, 16_384]);
    }

    #[test]
    fn no_seed_stays_where_it_is() {
        for seed in 0..=u16::MAX {
            let mut backoff = Backoff::new(seed);
            let before = backoff.0;
            backoff.next_ms();
            assert_ne!(backoff.0, before, "{seed}");
        }
    }

    #[test]
    fn two_ends_part_soon() {
        for seed in 1..=2000 {
            let (mut one, mut other) = (Backoff::new(seed), Backoff::new(seed + 1));
            assert!((0..8).any(|_| one.next_ms() != other.next_ms()), "seeds {seed} and the next");
        }
    }
}
