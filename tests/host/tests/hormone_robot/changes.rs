//! Changes while walking: without reprogramming, the gait is right again after discovery and a Period.

use hormone::action::Action;
use hormone::gait::GaitName::Centipede;
use hormone::module_type::ModuleType;
use tasks::dock::Dock::{Back, Front, Left, Right};

use crate::robot::{Robot, Segment};
use Segment::{Branch, Spine};

const PERIOD: u32 = 1_000;
/// How long it may take to notice a lost neighbour, which takes longer than finding one.
const DISCOVERY: u32 = 300;

/// Head 0, branch 1 with legs 2 and 3, spine 4, branch 5 with legs 6 and 7, spine 8, tail 9; walking.
fn walking(seed: u64) -> Robot {
    let mut robot = Robot::with_body(Centipede.gait(), &[Branch, Spine, Branch, Spine], seed);
    robot.longest_delay = 3;
    robot.discover(150).unwrap();
    let known = robot.now;
    robot.run(3_000);
    assert_eq!(robot.gait_violations(known, robot.now), 0);
    robot
}

/// Checks that after a change at this moment the gait is right in time and stays so.
fn recovers(robot: &mut Robot) {
    let changed = robot.now;
    robot.discover(DISCOVERY).expect("discovery in time");
    robot.run(8 * PERIOD);
    assert_eq!(robot.gait_violations(changed + DISCOVERY + PERIOD, robot.now), 0);
}

#[test]
fn legs_are_taken_off_and_put_on_elsewhere() {
    for seed in 0..8 {
        let mut robot = walking(seed);
        robot.run(97 * seed as u32);
        robot.detach((5, Left));
        robot.detach((5, Right));
        recovers(&mut robot);
        assert_eq!(robot.module_type(5), ModuleType::Spine);

        robot.attach((4, Left), (6, Back));
        robot.attach((4, Right), (7, Back));
        recovers(&mut robot);
        assert_eq!(robot.module_type(4), ModuleType::Branch);
    }
}

#[test]
fn a_branch_with_one_leg_passes_the_beat_on() {
    let mut robot = walking(1);
    robot.detach((1, Right));
    robot.discover(DISCOVERY).unwrap();
    assert_eq!(robot.module_type(1), ModuleType::Other);
    let before = robot.hormones_received(9).len();
    robot.run(5 * PERIOD);
    assert_eq!(robot.hormones_received(9).len() - before, 10, "each beat reaches the tail, once");
}

#[test]
fn a_leg_and_a_spine_change_places() {
    for seed in 0..8 {
        let mut robot = walking(seed);
        robot.run(101 * seed as u32);
        robot.swap(3, 4);
        recovers(&mut robot);
        assert_eq!(robot.module_type(3), ModuleType::Spine);
        assert_eq!(robot.module_type(4), ModuleType::RightLeg);
    }
}

#[test]
fn cut_in_two_both_halves_walk_and_joined_they_walk_as_one() {
    for seed in 0..8 {
        let mut robot = walking(seed);
        robot.run(103 * seed as u32);
        // The halves: head, branch 1 and spine 4, now the tail; branch 5 needs a head of its own.
        robot.detach((4, Back));
        robot.detach((8, Back));
        robot.attach((9, Back), (5, Front));
        robot.discover(DISCOVERY).unwrap();
        assert_eq!(robot.module_type(4), ModuleType::Tail);
        assert_eq!(robot.module_type(8), ModuleType::Tail);
        assert_eq!(robot.module_type(9), ModuleType::Head);
        recovers(&mut robot);

        robot.attach((4, Back), (9, Front));
        recovers(&mut robot);
        assert_eq!(robot.module_type(9), ModuleType::Spine);
    }
}

#[test]
fn any_module_may_be_reset() {
    for module in 0..10 {
        let mut robot = walking(module as u64);
        robot.run(89 * module as u32);
        robot.reset(module);
        recovers(&mut robot);
    }
}

/// Checks that these legs swing and hold in turn, each half Period, the left one opposite to the right one.
fn legs_alternate(robot: &mut Robot, legs: &[usize]) {
    let from = robot.now;
    robot.run(8 * PERIOD);
    for &leg in legs {
        let acts = robot.acts(leg).iter().filter(|act| act.at >= from);
        let actions: Vec<Action> = acts.map(|act| act.action).collect();
        assert_eq!(actions.len(), 16);
        assert!(actions.iter().all(|action| matches!(action, Action::Swing | Action::Holding)));
        assert!(actions.windows(2).all(|pair| pair[0] != pair[1]), "leg {leg}: {actions:?}");
    }
    for pair in legs.chunks_exact(2) {
        assert!(robot.together(pair[0], pair[1], from, robot.now) <= 16 * 3, "legs {pair:?}");
    }
}

#[test]
fn behind_a_dead_module_another_leads() {
    // A branch takes the place of the head, or of the spine before the other branch.
    for (dead, leader) in [(0, 1), (4, 5)] {
        let mut robot = walking(7);
        robot.kill(dead);
        robot.run(DISCOVERY + PERIOD);
        assert_eq!(robot.module_type(leader), ModuleType::Other);
        legs_alternate(&mut robot, &[2, 3, 6, 7]);
    }
}

#[test]
fn with_a_dead_leg_all_others_go_on() {
    let mut robot = walking(5);
    robot.kill(2);
    robot.run(DISCOVERY + PERIOD);
    legs_alternate(&mut robot, &[6, 7, 3]);
}

#[test]
fn a_dock_blind_in_one_direction_parts_the_body_until_it_sees_again() {
    for blind in [(4, Back), (9, Front)] {
        let mut robot = walking(6);
        robot.detach((8, Back));
        robot.detach((4, Back));
        robot.attach((4, Back), (9, Front));
        robot.attach((9, Back), (5, Front));
        recovers(&mut robot);
        robot.blind.push(blind);
        recovers(&mut robot);
        assert_eq!(robot.module_type(9), ModuleType::Head);
        robot.blind.clear();
        recovers(&mut robot);
        assert_eq!(robot.module_type(9), ModuleType::Spine);
    }
}
