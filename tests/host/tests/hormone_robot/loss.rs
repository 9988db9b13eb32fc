//! Links that lose three frames of four, each way: no leg misses a half Period or does one twice.

use hormone::action::Action;
use hormone::gait::GaitName::Centipede;

use crate::robot::{Robot, hundred_modules};

const MINUTE: u32 = 60_000;

/// Milliseconds for links to be found lossy and beats to settle along the body.
const SETTLED: u32 = 30_000;

/// The half Period, in milliseconds. A half Period may be shorter or longer by half of that.
const HALF_PERIOD: u32 = 500;

/// How often in `from..to` a leg did not go from Swing to Holding and back once in about half a Period.
fn stumbles(robot: &Robot, leg: usize, from: u32, to: u32) -> usize {
    let acts: Vec<_> = robot.acts(leg).iter().filter(|act| (from..to).contains(&act.at)).collect();
    let is_wrong = |pair: &&[&crate::robot::Act]| {
        let time = pair[1].at - pair[0].at;
        pair[0].action == pair[1].action || time.abs_diff(HALF_PERIOD) > HALF_PERIOD / 2
    };
    let rests = acts.iter().filter(|act| !matches!(act.action, Action::Swing | Action::Holding)).count();
    let missing = usize::abs_diff(acts.len(), ((to - from) / HALF_PERIOD) as usize).saturating_sub(1);
    acts.windows(2).filter(is_wrong).count() + rests + missing
}

#[test]
fn a_hundred_modules_walk_a_minute_with_three_frames_of_four_lost_each_way() {
    for seed in [1, 2] {
        let mut robot = Robot::with_body(Centipede.gait(), &hundred_modules(seed), seed);
        robot.longest_delay = 5;
        robot.discover(150).unwrap();
        robot.frame_loss = 75;
        robot.run(SETTLED);
        let from = robot.now;
        let changes = robot.topology_changes();
        robot.run(MINUTE);
        assert_eq!(robot.topology_changes(), changes, "a neighbour was missed");
        assert!(robot.knows_itself());
        let legs: Vec<usize> = (0..robot.len()).filter(|&module| robot.other_leg(module).is_some()).collect();
        assert_eq!(legs.len(), 48);
        for leg in legs {
            assert_eq!(stumbles(&robot, leg, from, robot.now), 0, "leg {leg}: {:?}", robot.acts(leg));
            let other = robot.other_leg(leg).unwrap();
            let together = robot.together(leg, other, from, robot.now);
            assert!(together <= 60 * MINUTE / 1_000, "legs {leg} and {other} did the same for {together} ms");
        }
    }
}
