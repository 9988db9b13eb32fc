//! Gaits of a chain: each joint follows the wave, for chains of any length.

use hormone::action::Action;
use hormone::gait::GaitName::{self, Caterpillar, Serpentine};

use crate::robot::{Robot, Segment};

/// Compares the joints of a chain of `modules` with `angles`: the angles of a module, by the fraction of a
/// Period since that module began one, and its number of places behind the head. A target is held for one of
/// `steps` steps of the Period.
fn holds_wave(gait: GaitName, modules: usize, angles: impl Fn(f64, usize) -> [f64; 2], steps: f64) {
    let mut robot = Robot::with_body(gait.gait(), &vec![Segment::Spine; modules - 2], modules as u64);
    robot.discover(150).unwrap();
    // A module that took itself for a head at the start may have been some ms early; each beat takes back
    // one.
    robot.run(6_000);
    let period = u32::from(gait.gait().period());
    for _ in 0..2 * period / 7 {
        robot.run(7);
        let start = robot.generated(0).iter().rev().find(|beat| beat.data as u8 == 0).unwrap().at;
        for place in 0..modules {
            let posture = robot.posture(place).expect("every module of the chain moves");
            assert_eq!(posture.roll, 0);
            // A hormone takes a millisecond from one module to the next.
            let now = f64::from(robot.now - start) - place as f64;
            let step = (now / f64::from(period) * steps).floor() / steps;
            for (joint, angle) in [posture.motor0, posture.motor2].into_iter().zip(angles(step, place)) {
                assert!(
                    (f64::from(joint) - angle).abs() <= 0.5,
                    "{joint}, not {angle:.1}, at {now} in {place}"
                );
            }
        }
    }
}

const TURN: f64 = std::f64::consts::TAU;

#[test]
fn the_caterpillars_wave_is_the_laboratorys() {
    // Motor0 at 20 cos(s pi / 10), Motor2 at 20 cos((s + 2) pi / 10), s four steps of 20 ahead from module to
    // module.
    let angles = |phase: f64, place: usize| {
        let s = 20.0 * phase + 4.0 * place as f64;
        [s, s + 2.0].map(|s| 20.0 * (s * TURN / 20.0).cos())
    };
    for modules in [2, 3, 6, 20] {
        holds_wave(Caterpillar, modules, angles, 20.0);
    }
}

#[test]
fn the_serpentines_wave_is_four_modules_long() {
    let angles = |phase: f64, place: usize| {
        let turns = phase + 0.25 * place as f64;
        [turns, turns + 0.125].map(|turns| 30.0 * (turns * TURN).cos())
    };
    for modules in [2, 4, 9, 20] {
        holds_wave(Serpentine, modules, angles, 16.0);
    }
}

#[test]
fn in_a_wave_every_module_does_the_same_action_each_beat() {
    for (gait, action) in [(Caterpillar, Action::Wave), (Serpentine, Action::Undulate)] {
        let mut robot = Robot::with_body(gait.gait(), &[Segment::Spine; 6], 5);
        robot.discover(150).unwrap();
        robot.run(1_000);
        let from = robot.now;
        robot.run(5_000);
        let beats = robot.beats_of(0, from, robot.now);
        for module in 0..robot.len() {
            assert!(robot.actions(module, &beats).iter().all(|&done| done == Some(action)));
        }
    }
}
