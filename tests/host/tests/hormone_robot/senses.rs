//! Legs whose accelerometers say that the robot lies on its back.

use hormone::action::Action::{self, Holding, HoldingOver, Swing, SwingOver};
use hormone::gait::GaitName::{self, Centipede, FourLegs, SixLegs};
use hormone::module_type::ModuleType::{LeftLeg, RightLeg};
use hormone::sense::LASTS;

use crate::robot::{Act, Random, Robot, Segment};
use Segment::{Branch, Spine};

const WALKS: [(GaitName, &[Segment]); 3] = [
    (Centipede, &[Branch, Spine, Branch, Branch, Spine]),
    (FourLegs, &[Branch, Spine, Branch]),
    (SixLegs, &[Branch, Spine, Branch, Spine, Branch]),
];

/// A robot that walks.
fn robot(gait: GaitName, body: &[Segment], seed: u64) -> Robot {
    let mut robot = Robot::with_body(gait.gait(), body, seed);
    robot.longest_delay = 3;
    robot.discover(150).unwrap();
    robot.run(3_000);
    robot
}

/// The actions of legs in `from..to`.
fn acts(robot: &Robot, from: u32, to: u32) -> Vec<Vec<Act>> {
    let legs = (0..robot.len()).filter(|&module| matches!(robot.module_type(module), LeftLeg | RightLeg));
    let acts = legs.map(|leg| robot.acts(leg).iter().filter(|act| (from..to).contains(&act.at)).copied());
    acts.map(Iterator::collect).collect()
}

/// Checks that in `from..to` each leg swings, by the action `swing`, in one beat of a Period and holds in all
/// others.
fn assert_walks(robot: &Robot, gait: GaitName, from: u32, to: u32, swing: Action) {
    let beats = usize::from(gait.gait().beats);
    for acts in acts(robot, from, to) {
        assert!(acts.len() >= 2 * beats, "{} beats", acts.len());
        for period in acts.windows(beats) {
            let count = |wanted| period.iter().filter(|act| act.action == wanted).count();
            let holding = if swing == SwingOver { HoldingOver } else { Holding };
            assert_eq!((count(swing), count(holding)), (1, beats - 1), "{swing:?} in {period:?}");
        }
    }
}

#[test]
fn who_is_turned_over_walks_on_with_its_feet_the_other_way_after_two_beats() {
    let mut random = Random::new(7);
    for (gait, body) in WALKS {
        let beat = u32::from(gait.gait().beat.get());
        for seed in 0..20 {
            let mut robot = robot(gait, body, seed);
            for (up, swing) in [(-870, SwingOver), (870, Swing)] {
                robot.run(random.below(2_000) as u32);
                robot.up = up;
                let turned_at = robot.now;
                robot.run(12 * beat + 2_000);
                assert_walks(&robot, gait, turned_at + 2 * beat + 5, robot.now, swing);
            }
            // No beat is left out meanwhile, for either direction of the feet.
            for acts in acts(&robot, 3_200, robot.now) {
                assert!(
                    acts.windows(2).all(|pair| (pair[1].at - pair[0].at).abs_diff(beat) <= 20),
                    "{acts:?}"
                );
            }
        }
    }
}

#[test]
fn an_answer_in_ten_may_be_lost() {
    for (gait, body) in WALKS {
        let mut robot = robot(gait, body, 3);
        robot.answer_loss = 10;
        robot.up = -1000;
        robot.run(3_000);
        let from = robot.now;
        robot.run(10_000);
        assert_walks(&robot, gait, from, robot.now, SwingOver);
    }
}

#[test]
fn a_sensor_that_fell_silent_is_forgotten() {
    for (gait, body) in WALKS {
        let beat = u32::from(gait.gait().beat.get());
        let mut robot = robot(gait, body, 4);
        robot.up = -1000;
        robot.run(6_000);
        robot.answer_loss = 100;
        let silent_at = robot.now;
        robot.run(20 * beat);
        let forgotten_at = silent_at + u32::from(LASTS + 1) * beat + 5;
        assert_walks(&robot, gait, forgotten_at, robot.now, Swing);
    }
}

#[test]
fn a_jolt_is_not_taken_for_lying_otherwise() {
    let mut random = Random::new(8);
    for (gait, body) in WALKS {
        for up in [1000, -1000] {
            let mut robot = robot(gait, body, 5);
            robot.up = up;
            robot.run(3_000);
            let from = robot.now;
            for _ in 0..100 {
                // A foot lands, and shakes the sensor.
                robot.up = -up;
                robot.run(1 + random.below(25) as u32);
                robot.up = up;
                robot.run(200 + random.below(200) as u32);
            }
            assert_walks(&robot, gait, from, robot.now, if up < 0 { SwingOver } else { Swing });
        }
    }
}
