//! Gaits on two, four and six legs.

use hormone::action::Action::{Holding, Swing};
use hormone::gait::GaitName::{self, ButterflyStroke, FourLegs, SixLegs};
use hormone::module_type::ModuleType::{LeftLeg, RightLeg};

use crate::robot::{Robot, Segment};
use Segment::{Branch, Spine};

/// The legs in the order of [`Robot::with_body`]: left and right of the first pair, of the second, and so on.
fn legs(robot: &Robot) -> Vec<usize> {
    let is_leg = |&module: &usize| matches!(robot.module_type(module), LeftLeg | RightLeg);
    (0..robot.len()).filter(is_leg).collect()
}

/// For each beat of the head, the legs that swing in it, as indices into `legs`. All others hold.
fn swinging(gait: GaitName, body: &[Segment], seed: u64) -> Vec<Vec<usize>> {
    let mut robot = Robot::with_body(gait.gait(), body, seed);
    robot.longest_delay = 3;
    robot.discover(150).unwrap();
    robot.run(2_000);
    let from = robot.now;
    robot.run(10_000);
    let beats = robot.beats_of(0, from, robot.now);
    assert!(beats.len() > 12);
    let done: Vec<_> = legs(&robot).into_iter().map(|leg| robot.actions(leg, &beats)).collect();
    (0..beats.len())
        .map(|beat| {
            assert!(done.iter().all(|actions| matches!(actions[beat], Some(Swing | Holding))), "{done:?}");
            (0..done.len()).filter(|&leg| done[leg][beat] == Some(Swing)).collect()
        })
        .collect()
}

/// Whether the swinging legs of successive beats follow `order`, round and round.
fn goes_round(beats: &[Vec<usize>], order: &[&[usize]]) -> bool {
    let place = |swinging: &Vec<usize>| order.iter().position(|wanted| wanted == swinging);
    beats.iter().all(|beat| place(beat).is_some())
        && beats
            .windows(2)
            .all(|pair| place(&pair[1]) == place(&pair[0]).map(|place| (place + 1) % order.len()))
}

#[test]
fn arms_of_a_butterfly_swing_together_and_pull_together() {
    for (seed, body) in (0..).zip([&[Branch][..], &[Spine, Branch, Spine], &[Branch, Spine, Branch]]) {
        let beats = swinging(ButterflyStroke, body, seed);
        let all: Vec<usize> = (0..2 * body.iter().filter(|&&segment| segment == Branch).count()).collect();
        assert!(goes_round(&beats, &[&all, &[]]), "{beats:?}");
    }
}

const LEFT_FRONT: usize = 0;
const RIGHT_FRONT: usize = 1;
const LEFT_HIND: usize = 2;
const RIGHT_HIND: usize = 3;

#[test]
fn on_four_legs_one_swings_at_a_time_each_hind_one_before_the_front_one_of_its_side() {
    for (seed, body) in
        (0..).zip([&[Branch, Branch][..], &[Branch, Spine, Branch], &[Spine, Branch, Spine, Spine, Branch]])
    {
        let beats = swinging(FourLegs, body, seed);
        let order: [&[usize]; 4] = [&[LEFT_HIND], &[LEFT_FRONT], &[RIGHT_HIND], &[RIGHT_FRONT]];
        assert!(goes_round(&beats, &order), "{beats:?}");
    }
}

#[test]
fn on_six_legs_one_swings_at_a_time_from_the_hind_leg_of_each_side_to_the_front_one() {
    for (seed, body) in (0..).zip([&[Branch; 3][..], &[Branch, Spine, Branch, Spine, Branch, Spine]]) {
        let beats = swinging(SixLegs, body, seed);
        // Left legs are 0, 2, 4 from front to hind, right ones 1, 3, 5.
        assert!(goes_round(&beats, &[&[4], &[1], &[2], &[5], &[0], &[3]]), "{beats:?}");
        for side in [[4, 2, 0], [5, 3, 1]] {
            let of_side: Vec<usize> = beats.concat().into_iter().filter(|leg| side.contains(leg)).collect();
            let order = side.map(|leg| [leg]);
            let order: Vec<&[usize]> = order.iter().map(|leg| leg.as_slice()).collect();
            let of_side: Vec<Vec<usize>> = of_side.into_iter().map(|leg| vec![leg]).collect();
            assert!(goes_round(&of_side, &order), "from hind to front: {of_side:?}");
        }
    }
}
