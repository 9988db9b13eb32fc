//! The controller of a position: proportional, integral and derivative, in 16 bits without a division.

use super::{DEGREE, FULL_DRIVE, Position};

/// An error counts up to here, 12 degrees: that much asks for more than full drive.
const LARGEST_ERROR: i16 = 12 * DEGREE;

/// The integral is kept in 1/64 of a drive.
const INTEGRAL_FRACTION: u32 = 6;

/// The integral's share of the drive: at most full drive. What an error adds fits above it.
const LARGEST_INTEGRAL: i16 = FULL_DRIVE << INTEGRAL_FRACTION;
const _: () = assert!(LARGEST_INTEGRAL < i16::MAX - integral(LARGEST_ERROR));

/// The position is smoothed over 2 to this power periods. Fewer would take a larger share below for as much
/// damping, and so give on more of the converter's noise.
const SMOOTHING: u32 = 5;

/// The units of error that a position so many units ahead of its smoothed value counts for: 1/4. Found by
/// trial on the assumed plant, as are the other shares; `tests/host/tests/joint.rs` holds them to it.
#[inline(always)]
const fn derivative(ahead: i16) -> i16 {
    ahead >> 2
}

/// The drive for so many units of error: 3/4.
///
/// The AVR's compiler multiplies 16 bits in 22 cycles, and this takes 7.
#[inline(always)]
const fn proportional(units: i16) -> i16 {
    units - (units >> 2)
}

/// The amount that an error adds to the integral in a period: 1/4, in 1/64 drive.
#[inline(always)]
const fn integral(error: i16) -> i16 {
    error >> 2
}

/// The controller's state from period to period.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Pid {
    integral: i16,
    smoothed: Position,
}

impl Pid {
    /// A controller that begins at rest at `position`.
    pub const fn at(position: Position) -> Self {
        Pid { integral: 0, smoothed: position }
    }

    /// One period: the drive that takes `position` to `setpoint`, `ceiling` at most (0 to [`FULL_DRIVE`])
    /// either way.
    ///
    /// `feed_forward` is the drive that a moving setpoint is known to take, so that the integral need not
    /// learn it and then forget it. Without it, the integral carries the joint past a target that it comes to
    /// at a steady speed. The derivative is that of the position, so that a step of the setpoint gives no
    /// jerk. An error of less than `tolerance` adds nothing to the integral, nor does one that would drive
    /// further into the ceiling: it does not wind up.
    #[inline]
    pub fn step(
        &mut self,
        setpoint: Position,
        position: Position,
        tolerance: Position,
        feed_forward: i16,
        ceiling: i16,
    ) -> i16 {
        let error = difference(setpoint, position);
        let ahead = difference(position, self.smoothed);
        self.smoothed = self.smoothed.wrapping_add(ahead >> SMOOTHING);
        let sought =
            proportional(error - derivative(ahead)) + (self.integral >> INTEGRAL_FRACTION) + feed_forward;
        let drive = sought.min(ceiling).max(-ceiling); // `clamp` panics where the ceiling is below 0
        let winds_up = if error < 0 { sought < drive } else { sought > drive };
        if !winds_up && error.abs() >= tolerance {
            self.integral = (self.integral + integral(error)).clamp(-LARGEST_INTEGRAL, LARGEST_INTEGRAL);
        }
        drive
    }
}

/// `one - other`, but [`LARGEST_ERROR`] at most either way.
#[inline(always)]
fn difference(one: Position, other: Position) -> i16 {
    // Half of what `saturating_sub` and `clamp` take.
    let counts = one.abs_diff(other).min(LARGEST_ERROR.unsigned_abs()) as i16;
    if one < other { -counts } else { counts }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TOLERANCE: Position = 24;

    #[test]
    fn an_integral_at_a_ceiling_does_not_wind_up() {
        let mut pid = Pid::at(0);
        for _ in 0..10_000 {
            assert_eq!(pid.step(20_000, 0, TOLERANCE, 0, 100), 100);
        }
        assert_eq!(pid.integral, 0);
        // Back at the setpoint the drive ends at once.
        assert_eq!(pid.step(0, 0, TOLERANCE, 0, 100), 0);
    }

    #[test]
    fn a_lasting_error_is_met_with_ever_more_drive() {
        let mut pid = Pid::at(0);
        let first = pid.step(50, 0, TOLERANCE, 0, FULL_DRIVE);
        let mut last = first;
        for _ in 0..5_000 {
            let drive = pid.step(50, 0, TOLERANCE, 0, FULL_DRIVE);
            assert!(drive >= last);
            last = drive;
        }
        assert_eq!((first, last), (38, FULL_DRIVE));
    }

    #[test]
    fn what_is_within_tolerance_changes_nothing() {
        let mut pid = Pid::at(0);
        for _ in 0..1_000 {
            assert_eq!(pid.step(TOLERANCE - 1, 0, TOLERANCE, 0, FULL_DRIVE), 18);
        }
    }

    #[test]
    fn motion_is_braked_whichever_way_it_goes() {
        let driven = |position: Position| {
            let mut pid = Pid::at(0);
            pid.step(position, position, TOLERANCE, 0, FULL_DRIVE).signum()
        };
        assert_eq!([driven(100), driven(0), driven(-100)], [-1, 0, 1]);
    }

    proptest! {
        /// No input overflows (which would panic here), or gives more than the ceiling.
        #[test]
        fn the_ceiling_holds(
            inputs in prop::collection::vec((any::<i16>(), any::<i16>(), -FULL_DRIVE..=FULL_DRIVE, 0..=FULL_DRIVE), 1..200),
            start: i16,
        ) {
            let mut pid = Pid::at(start);
            for (setpoint, position, forward, ceiling) in inputs {
                let drive = pid.step(setpoint, position, TOLERANCE, forward, ceiling);
                prop_assert!((-ceiling..=ceiling).contains(&drive));
            }
        }

        #[test]
        fn a_difference_counts_up_to_the_largest_error(one: i16, other: i16) {
            let largest = i32::from(LARGEST_ERROR);
            let expected = (i32::from(one) - i32::from(other)).clamp(-largest, largest);
            prop_assert_eq!(i32::from(difference(one, other)), expected);
        }

        /// A mirrored world is driven the mirrored way, but for what shifts round down.
        #[test]
        fn both_directions_are_alike(
            inputs in prop::collection::vec((-20_000..20_000_i16, -20_000..20_000_i16), 1..50),
        ) {
            let (mut pid, mut mirrored) = (Pid::at(0), Pid::at(0));
            for (setpoint, position) in inputs {
                let drive = pid.step(setpoint, position, TOLERANCE, 0, FULL_DRIVE);
                let other = mirrored.step(-setpoint, -position, TOLERANCE, 0, FULL_DRIVE);
                prop_assert!((drive + other).abs() <= 24, "{drive} {other}");
            }
        }
    }
}
