//! A robot changes its shape: a chain of six closes to a ring, rolls, opens again and crawls on.

use hormone::action::{Action, Docking};
use hormone::gait::GaitName::{self, Caterpillar, CloseRing, OpenRing, RollingTrack};
use hormone::module_type::ModuleType::{Head, Spine, Tail};
use tasks::dock::Dock::{Back, Front};

use crate::orders::walk;
use crate::robot::Robot;

const MODULES: usize = 6;

/// How long a latch takes, in milliseconds.
const LATCH: u32 = 400;

fn chain() -> Robot {
    let mut robot = Robot::new(Caterpillar.gait(), MODULES, 6);
    robot.longest_delay = 3;
    for module in 1..MODULES {
        robot.attach((module - 1, Back), (module, Front));
    }
    robot.discover(150).unwrap();
    robot.run(3_000);
    robot
}

/// Runs for `milliseconds` with the docks' motors. If the body lies in a circle, its ends latch when a dock
/// of one approaches; a released dock lets go.
fn run(robot: &mut Robot, milliseconds: u32) {
    for _ in 0..milliseconds / LATCH {
        robot.run(LATCH);
        for module in 0..MODULES {
            match robot.acts(module).last().and_then(|act| act.action.docking()) {
                Some(Docking::Approach(Back)) if robot.wire((module, Back)).is_none() && is_circle(robot) => {
                    let other = (0..MODULES).find(|&other| robot.wire((other, Front)).is_none()).unwrap();
                    robot.attach((module, Back), (other, Front));
                }
                Some(Docking::Release(Front)) => robot.detach((module, Front)),
                _ => {}
            }
        }
    }
}

fn is_circle(robot: &Robot) -> bool {
    (0..MODULES).all(|module| {
        let posture = robot.posture(module);
        posture.is_some_and(|posture| (posture.motor0, posture.roll, posture.motor2) == (30, 0, 30))
    })
}

fn all_walk(robot: &Robot, gait: GaitName, action: Action) {
    for module in 0..MODULES {
        assert_eq!(robot.gait(module), Some(gait), "module {module}");
        assert_eq!(robot.acts(module).last().unwrap().action, action, "module {module}");
    }
}

#[test]
fn a_chain_becomes_a_ring_and_a_chain_again() {
    // Any module may get the order.
    for ordered in 0..MODULES {
        let mut robot = chain();
        all_walk(&robot, Caterpillar, Action::Wave);

        robot.order(ordered, walk(CloseRing, 0));
        run(&mut robot, 12_000);
        assert_eq!(robot.of_type(Spine).count(), MODULES);
        assert!(robot.knows_itself());
        all_walk(&robot, RollingTrack, Action::Roll);

        robot.order(ordered, walk(OpenRing, 10));
        run(&mut robot, 12_000);
        assert_eq!([robot.of_type(Head).count(), robot.of_type(Tail).count()], [1, 1]);
        assert!(robot.knows_itself());
        all_walk(&robot, Caterpillar, Action::Wave);
    }
}

#[test]
fn a_chain_that_breaks_while_it_closes_does_not_roll() {
    let mut robot = chain();
    robot.order(0, walk(CloseRing, 0));
    robot.run(700);
    robot.detach((2, Back));
    robot.run(6_000);
    assert!((0..MODULES).all(|module| robot.gait(module) == Some(CloseRing)));
}
