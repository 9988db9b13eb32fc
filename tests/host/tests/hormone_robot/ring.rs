//! The rolling track: a ring without head or numbers, which elects its leader.

use hormone::gait::GaitName::RollingTrack;
use hormone::module_type::ModuleType::Spine;
use tasks::dock::Dock::{Back, Front};

use crate::robot::Robot;

/// The time from the first missing beat until there is a new leader and the ring rolls, at most, in
/// milliseconds: two rounds of silence, one of candidacy, and a Period.
const ELECTED: u32 = 6_300;

/// A leader beats at least once in this time, in milliseconds.
const BEAT: u32 = 1_100;

fn ring(modules: usize, seed: u64) -> Robot {
    let mut robot = Robot::new(RollingTrack.gait(), modules, seed);
    robot.longest_delay = 3;
    for module in 0..modules {
        robot.attach((module, Back), ((module + 1) % modules, Front));
    }
    robot
}

/// The modules that have beaten since `from`.
fn leaders(robot: &Robot, from: u32) -> Vec<usize> {
    (0..robot.len()).filter(|&module| robot.generated(module).iter().any(|beat| beat.at >= from)).collect()
}

/// Checks a ring of six against its gait: it stays closed, and the bend runs round it.
fn rolls(robot: &mut Robot) {
    let modules: Vec<usize> = robot.of_type(Spine).collect();
    let count = modules.len();
    assert_eq!(count, 6);
    for _ in 0..200 {
        robot.run(17);
        let joints: Vec<i32> = ring_order(robot, modules[0])
            .into_iter()
            .filter_map(|module| robot.posture(module))
            .flat_map(|posture| [posture.motor0.into(), posture.motor2.into()])
            .collect();
        assert_eq!(joints.len(), 12);
        // While a hormone is on its way one module is a step behind: 15 or 30 degrees at one joint or two.
        assert!((joints.iter().sum::<i32>() - 360).abs() <= 60, "{joints:?}");
        for (one, opposite) in joints.iter().zip(&joints[6..]) {
            assert!((one - opposite).abs() <= 30, "{joints:?}");
        }
    }
}

/// The modules of a ring from `first` on, each one's Back at the next.
fn ring_order(robot: &Robot, first: usize) -> Vec<usize> {
    let next =
        |&module: &usize| robot.wire((module, Back)).map(|(next, _)| next).filter(|&next| next != first);
    std::iter::successors(Some(first), next).collect()
}

#[test]
fn a_ring_of_six_elects_a_leader_and_rolls() {
    for seed in 0..20 {
        let mut robot = ring(6, seed);
        robot.run(ELECTED);
        let from = robot.now;
        rolls(&mut robot);
        assert_eq!(leaders(&robot, from).len(), 1, "seed {seed}");
    }
}

#[test]
fn rings_of_other_sizes_elect_one_leader_too_and_no_hormone_stays_in_them() {
    for modules in [2, 3, 5, 12, 50, 100] {
        let mut robot = ring(modules, modules as u64);
        robot.run(ELECTED + 1_000);
        let from = robot.now;
        robot.run(10_000);
        let leaders = leaders(&robot, from);
        assert_eq!(leaders.len(), 1, "{modules} modules");
        let beats = robot.beats_of(leaders[0], from, robot.now).len();
        for module in 0..modules {
            let received = robot.hormones_received(module).iter().filter(|beat| beat.at >= from).count();
            assert!(received.abs_diff(beats) <= 2, "{received} of {beats} in {module} of {modules}");
        }
    }
}

#[test]
fn when_the_leader_leaves_another_is_elected() {
    for seed in 0..10 {
        let mut robot = ring(7, seed);
        robot.run(ELECTED);
        let [leader] = leaders(&robot, robot.now - BEAT)[..] else { panic!("one leader") };
        let (before, after) = ((leader + 6) % 7, (leader + 1) % 7);
        robot.detach((before, Back));
        robot.detach((leader, Back));
        robot.attach((before, Back), (after, Front));
        robot.run(300 + ELECTED);
        let from = robot.now;
        rolls(&mut robot);
        let new = leaders(&robot, from);
        assert!(new.len() == 1 && new[0] != leader, "seed {seed}: {new:?}");
    }
}

#[test]
fn two_rings_that_become_one_agree_on_a_leader() {
    for seed in 0..10 {
        let mut robot = Robot::new(RollingTrack.gait(), 6, seed);
        for first in [0, 3] {
            for place in 0..3 {
                robot.attach((first + place, Back), (first + (place + 1) % 3, Front));
            }
        }
        robot.run(ELECTED);
        assert_eq!(leaders(&robot, robot.now - BEAT).len(), 2);
        robot.detach((2, Back));
        robot.detach((5, Back));
        robot.attach((2, Back), (3, Front));
        robot.attach((5, Back), (0, Front));
        robot.run(300 + ELECTED);
        let from = robot.now;
        rolls(&mut robot);
        assert_eq!(leaders(&robot, from).len(), 1, "seed {seed}");
    }
}

#[test]
fn a_chain_that_should_roll_keeps_still() {
    let mut robot = Robot::new(RollingTrack.gait(), 5, 1);
    for module in 0..4 {
        robot.attach((module, Back), (module + 1, Front));
    }
    robot.run(10_000);
    assert!(leaders(&robot, 0).is_empty());
    assert!((0..5).all(|module| robot.posture(module).is_none()));
}
