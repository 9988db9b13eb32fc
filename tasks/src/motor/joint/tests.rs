//! The limits between what a joint does by itself and what is a fault of it. `tests/host/tests/joint.rs`
//! tries on a plant how a joint moves.

extern crate std;

use super::*;
use crate::superbot::{JOINT, JOINT_CURRENT_LIMIT};

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
        assert_eq!(joint.position(), (bad < BAD_READINGS).then_some(493));
    }
    assert_eq!(joint.state(), State::BrokenPotentiometer);
}

/// Its MCU's other joint is controlled meanwhile. Told to turn by an angle, it would count from there.
#[test]
fn a_joint_that_is_off_and_can_not_be_measured_any_more_is_not_where_it_was() {
    let mut joint = Joint::new(JOINT);
    joint.step(reading(0));
    for _ in 0..BAD_READINGS {
        assert_eq!(joint.position(), POTENTIOMETER.position(512));
        joint.step(Reading { potentiometer: 0, current: 0 });
    }
    assert_eq!((joint.position(), joint.state()), (None, State::Off));
}

#[test]
fn a_joint_that_is_off_is_where_it_is_found() {
    let mut joint = Joint::new(JOINT);
    joint.step(reading(0));
    // It was turned by hand while it was not measured.
    for _ in 0..100 {
        assert_eq!(joint.step(reading(200)), 0);
    }
    assert_eq!(joint.position(), POTENTIOMETER.position(712));
    assert_eq!(joint.state(), State::Off);
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
fn too_much_current_lowers_the_ceiling_quickly_and_less_raises_it_slowly() {
    let mut joint = moving();
    let limit = JOINT_CURRENT_LIMIT;
    joint.limit_current(limit + 1);
    assert_eq!(joint.ceiling, FULL_DRIVE - FULL_DRIVE / 16);
    joint.limit_current(limit);
    assert_eq!(joint.ceiling, FULL_DRIVE - FULL_DRIVE / 16 + 1);
    for _ in 0..FULL_DRIVE {
        joint.limit_current(0);
    }
    assert_eq!(joint.ceiling, FULL_DRIVE);
}

#[test]
fn at_an_end_stop_there_is_drive_back_and_none_on() {
    let joint = moving();
    let end = 900 * TENTH;
    for (position, both) in [(end - 1, [-7, 7]), (end, [-7, 0]), (end + 1, [-7, 0]), (0, [-7, 7])] {
        assert_eq!([-7, 7].map(|drive| joint.stop_at_ends(position, drive)), both, "{position}");
        let [down, up] = both.map(|drive: i16| -drive);
        assert_eq!([-7, 7].map(|drive| joint.stop_at_ends(-position, drive)), [up, down], "{position}");
    }
}

#[test]
fn a_joint_has_arrived_once_its_setpoint_has_and_it_is_there() {
    let target = 600 * TENTH;
    let arrives = |setpoint: Position, position: Position| {
        let mut joint = moving();
        (joint.setpoint, joint.mark) = (setpoint, position);
        joint.review(position, 0, 0);
        joint.state() == State::Arrived
    };
    assert!(arrives(target, target) && arrives(target, target - ARRIVED as i16));
    assert!(!arrives(target, target - ARRIVED as i16 - 1) && !arrives(target - 1, target));
}

#[test]
fn strong_drive_far_from_the_target_and_no_way_is_a_stall_and_less_is_none() {
    let limit = JOINT_CURRENT_LIMIT;
    let looked_at = |off: Position, way: Position, drive: i16, current: u16, reviews: u8| {
        let mut joint = moving();
        let position = 600 * TENTH - off;
        (0..reviews).all(|_| {
            // Where it was when it had made its way.
            joint.mark = position - way;
            joint.review(position, drive, current)
        })
    };
    let reviewed = |off, drive, reviews| looked_at(off, 0, drive, limit, reviews);
    assert!(!reviewed(2 * DEGREE + 1, STRONG_DRIVE as i16, STALL));
    assert!(reviewed(2 * DEGREE + 1, STRONG_DRIVE as i16, STALL - 1));
    assert!(reviewed(2 * DEGREE, STRONG_DRIVE as i16, STALL));
    assert!(reviewed(2 * DEGREE + 1, STRONG_DRIVE as i16 - 1, STALL));
    // So is too much current, wherever that is; and a degree is no way yet.
    assert!(!looked_at(0, WAY as i16, 0, limit + 1, STALL) && !looked_at(0, 0, 0, limit + 9, STALL));
    assert!(looked_at(0, WAY as i16 + 1, 0, limit + 1, STALL));
    assert_eq!([STRONG_DRIVE as i16, WAY as i16], [100, 160], "a quarter of the drive, a degree");
}

#[test]
fn a_joint_that_keeps_to_its_setpoint_has_not_stalled() {
    for (lag, stays_on) in [(2 * DEGREE, true), (2 * DEGREE + 1, false)] {
        let mut joint = moving();
        joint.setpoint = lag;
        assert_eq!((0..STALL).all(|_| joint.review(0, FULL_DRIVE, 0)), stays_on, "{lag}");
    }
}

#[test]
fn a_joint_held_near_its_target_gives_way_until_it_makes_way_or_is_told_another_target() {
    const STRONG: i16 = STRONG_DRIVE as i16;
    let position = 600 * TENTH - DEGREE;
    // Reviews of which each counts, and the ceiling then.
    let review = |joint: &mut Joint, position, drive, reviews: u8| {
        joint.ceiling = FULL_DRIVE;
        joint.period = 0;
        assert!((0..reviews).all(|_| joint.review(position, drive, 0)));
        joint.ceiling
    };
    let held_for = |reviews| {
        let mut joint = moving();
        (joint.mark, joint.setpoint) = (position, joint.target);
        assert_eq!(review(&mut joint, position, STRONG, reviews), FULL_DRIVE);
        joint
    };
    let held = || held_for(HELD);
    for held_at in [position, 600 * TENTH - TOLERANCE] {
        assert_eq!(review(&mut held(), held_at, STRONG, 1), STRONG);
    }
    for (position, drive, why) in [
        (position + WAY as i16 + 1, STRONG, "it makes way"),
        (600 * TENTH - TOLERANCE + 1, STRONG, "it is at its target"),
    ] {
        let mut joint = held();
        assert_eq!(review(&mut joint, position, drive, 1), FULL_DRIVE, "{why}");
        assert!(joint.held <= 1, "{why}");
    }
    let mut joint = held_for(HELD - 1);
    review(&mut joint, position, STRONG - 1, 1);
    assert_eq!(joint.held, 0, "it is not held by much");
    for (target, ceiling) in [(600, STRONG), (610, FULL_DRIVE)] {
        let mut joint = held();
        joint.turn_to(target, 9);
        joint.advance_setpoint(position);
        assert_eq!(review(&mut joint, position, STRONG, 1), ceiling, "told {target}");
    }
}

/// A joint at rest at 0 degrees.
fn resting() -> Joint {
    let mut joint = Joint::new(JOINT);
    joint.turn_to(0, 255);
    for _ in 0..REVIEW {
        joint.step(reading(4));
    }
    for _ in 0..(u16::from(SETTLED) + 2) * u16::from(REVIEW) {
        joint.step(reading(0));
    }
    assert!(joint.is_at_rest());
    joint
}

#[test]
fn a_joint_that_a_load_has_moved_a_little_for_good_is_at_rest_no_longer() {
    for off in [-1, 1] {
        let mut joint = resting();
        for look in 1..CREPT {
            joint.watch(reading(off));
            assert!(joint.is_at_rest(), "after {look} looks");
        }
        joint.watch(reading(off));
        assert!(!joint.is_at_rest());
    }
}

#[test]
fn the_noise_of_the_converter_does_not_disturb_a_joint_at_rest() {
    let mut joint = resting();
    for look in 0..1000 {
        joint.watch(reading(if look % i16::from(CREPT) == 0 { 0 } else { 1 }));
        assert!(joint.is_at_rest());
    }
}
