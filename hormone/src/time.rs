//! The behaviours' clock: milliseconds in a `u16`, which wraps every 65.5 s.
//!
//! A moment counts as past for the 32.7 s after it and as future for the 32.7 s before it, so a reading that
//! is a little older than the last one, as between two tasks, does no harm. Code that keeps a moment for
//! longer has to forget it or keep it up to date: else a moment long past would count as future.

pub use kernel::LONGEST;

/// Whether `now` is at or after `due`.
pub fn reached(due: u16, now: u16) -> bool {
    kernel::is_reached(due, now)
}

/// Milliseconds from `now` until `due`; 0 once it is reached.
pub fn until(due: u16, now: u16) -> u16 {
    if reached(due, now) { 0 } else { due.wrapping_sub(now) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_may_wrap_between_now_and_due() {
        assert!(reached(65_530, 65_530));
        assert!(reached(65_530, 4));
        assert!(!reached(4, 65_530));
        assert_eq!(until(4, 65_530), 10);
        assert_eq!(until(65_530, 4), 0);
    }

    #[test]
    fn half_the_range_is_past_and_half_is_future() {
        assert!(reached(0, 32_767));
        assert!(!reached(0, 32_768));
    }
}
