//! The limits between what a joint does by itself and what is a fault of it; how it moves is tried on a plant in
//! `tests/host/tests/joint.rs`.

extern crate std;

use super::*;
use crate::superbot::JOINT;

/// The converter's reading where the joint is so many of its counts from the middle.
fn reading(counts: i16) -> Reading {
    Reading { potentiometer: 512_u16.saturating_add_signed(counts), current: 0 }
}

/// A joint that lies in the middle and is on its way to 60 degrees.
fn moving() -> Joint {
    let mut joint = Joint::new(JOINT);
    joint.turn_to(600, 255);
    joint.step(reading(0));
    joint
}

#[test]
fn a_reading_too_far_off_for_one_period_is_none_of_the_joint() {
    // A count is 47 units, the middle of the first 23; and a joint turns 480 at most in a period.
    let mut joint = moving();
    joint.step(reading(10));
    assert_eq!(joint.position(), Some(493));
    for bad in 1..=BAD_READINGS {
        assert_eq!(joint.state(), State::Moving);
        assert_eq!(joint.step(reading(21)), 0, "{bad}");
        assert_eq!(joint.position(), Some(493));
    }
    assert_eq!(joint.state(), State::Failed(Fault::Potentiometer));
}

#[test]
fn the_setpoint_goes_five_degrees_ahead_and_waits() {
    let mut joint = moving();
    for _ in 0..100 {
        joint.advance_setpoint(0);
    }
    // No further than it moves in a period.
    assert!((5 * DEGREE..=5 * DEGREE + 41).contains(&joint.setpoint), "{}", joint.setpoint);
}

#[test]
fn strong_drive_far_from_the_target_and_no_way_is_a_stall_and_less_is_none() {
    let reviewed = |off: Position, drive: i16, reviews: u8| {
        let mut joint = moving();
        let position = 600 * TENTH - off;
        joint.mark = position;
        (0..reviews).all(|_| joint.review(position, drive, 0))
    };
    assert!(!reviewed(2 * DEGREE + 1, STRONG_DRIVE as i16, STALL));
    assert!(reviewed(2 * DEGREE + 1, STRONG_DRIVE as i16, STALL - 1));
    assert!(reviewed(2 * DEGREE, STRONG_DRIVE as i16, STALL));
    assert!(reviewed(2 * DEGREE + 1, STRONG_DRIVE as i16 - 1, STALL));
    assert_eq!([STRONG_DRIVE as i16, WAY as i16], [100, 160], "a quarter of the drive, a degree");
}
