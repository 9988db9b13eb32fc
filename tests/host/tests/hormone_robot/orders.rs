//! A remote control steers the robot and changes its gait. It may sit at any module, or be one.

use std::num::NonZeroU8;

use hormone::action::Action;
use hormone::gait::GaitName::{self, Caterpillar, Centipede, FourLegs};
use hormone::module_type::ModuleType::{LeftLeg, RightLeg};
use hormone::order::{Course, HOLDS, Order, Steer, What};
use hormone::period::Period;
use proptest::prelude::*;
use tasks::dock::Dock;

use crate::robot::{Robot, Segment, hundred_modules};
use Segment::{Branch, Spine};

/// An order of a course for all modules.
fn steer(course: Course, serial: u8) -> Order {
    Order { what: What::Steer(Steer { course, lifetime: NonZeroU8::MAX, held: 0 }), serial }
}

/// An order of a gait, in its own Period.
pub fn walk(gait: GaitName, serial: u8) -> Order {
    Order { what: What::Walk(gait as u8, Period::OWN), serial }
}

/// How far the hips of the left and of the right legs swing ahead in the next Period, in degrees.
fn strides(robot: &mut Robot) -> [Vec<i32>; 2] {
    let legs = [LeftLeg, RightLeg].map(|side| robot.of_type(side).collect::<Vec<_>>());
    let mut hips = vec![Vec::new(); robot.len()];
    for _ in 0..=Centipede.gait().period() / 10 {
        robot.run(10);
        for leg in legs.concat() {
            hips[leg].push(i32::from(robot.posture(leg).expect("a leg moves").motor2));
        }
    }
    legs.map(|side| side.into_iter().map(|leg| stride(&hips[leg])).collect())
}

/// How far a hip turns at once. While the leg holds, the hip turns in small steps.
fn stride(hips: &[i32]) -> i32 {
    let turns = hips.windows(2).map(|pair| pair[1] - pair[0]);
    turns.max_by_key(|turn| turn.abs()).expect("it swings")
}

#[test]
fn legs_on_the_inner_side_of_a_turn_step_back_half_the_stride_until_the_remote_control_is_silent() {
    let mut robot = Robot::with_body(Centipede.gait(), &hundred_modules(3), 3);
    robot.discover(150).unwrap();
    robot.run(2_000);
    let whole = strides(&mut robot);
    assert!(whole.concat().iter().all(|&stride| stride == 36));
    assert_eq!(whole.concat().len(), 48);

    for (serial, (course, inner)) in (0..).zip([(Course::Left, 0), (Course::Right, 1)]) {
        // A leg somewhere in the middle gives the order.
        let leg = robot.of_type(RightLeg).nth(12).unwrap();
        robot.order(leg, steer(course, serial));
        robot.run(200);
        let turning = strides(&mut robot);
        assert!(turning[inner].iter().all(|&stride| stride == -18), "{turning:?}");
        assert!(turning[1 - inner].iter().all(|&stride| stride == 36), "{turning:?}");
        assert_eq!(robot.gait_violations(robot.now - 2_000, robot.now), 0);
    }
    robot.run(u32::from(HOLDS));
    assert_eq!(strides(&mut robot), whole);
}

#[test]
fn a_robot_changes_its_gait_by_an_order_to_its_tail() {
    let mut robot = Robot::with_body(Centipede.gait(), &[Branch, Spine, Branch], 4);
    robot.discover(150).unwrap();
    robot.run(3_000);
    robot.order(robot.len() - 1, walk(FourLegs, 0));
    robot.run(3_000);
    let from = robot.now;
    robot.run(6_000);
    let beats = robot.beats_of(0, from, robot.now);
    let legs: Vec<usize> = robot.of_type(LeftLeg).chain(robot.of_type(RightLeg)).collect();
    assert_eq!(legs.len(), 4);
    for beat in 0..beats.len() {
        let swinging = legs.iter().filter(|&&leg| robot.actions(leg, &beats)[beat] == Some(Action::Swing));
        assert_eq!(swinging.count(), 1);
    }
}

#[test]
fn a_module_attached_to_a_robot_of_another_gait_walks_as_the_robot_does() {
    let mut robot = Robot::new(Centipede.gait(), 5, 5);
    for module in 0..3 {
        robot.attach((module, Dock::Back), (module + 1, Dock::Front));
    }
    robot.discover(150).unwrap();
    robot.order(0, walk(Caterpillar, 0));
    robot.run(3_000);
    robot.attach((3, Dock::Back), (4, Dock::Front));
    robot.run(3_000);
    assert_eq!(robot.acts(4).last().unwrap().action, Action::Wave);
}

#[test]
fn modules_attached_to_a_robot_that_turns_learn_the_course_before_it_is_said_again() {
    let mut robot = Robot::new(Centipede.gait(), 6, 5);
    for (module, dock) in [(0, Dock::Front), (1, Dock::Front), (3, Dock::Left), (4, Dock::Front)] {
        robot.attach((module, Dock::Back), (module + 1, dock));
    }
    robot.run(200);
    robot.order(0, steer(Course::Left, 1));
    robot.run(200);
    robot.attach((2, Dock::Back), (3, Dock::Front));
    robot.run(200);
    for module in 0..6 {
        assert_eq!(robot.course(module), Course::Left, "{module}");
    }
    robot.run(u32::from(HOLDS));
    assert!((0..6).all(|module| robot.course(module) == Course::Ahead));
}

/// Again and again one of two neighbours restarts while the other one holds the course, and tells it.
#[test]
fn a_course_is_over_in_time_though_modules_start_meanwhile_and_are_told_it() {
    let mut robot = Robot::with_body(Centipede.gait(), &[Spine, Branch, Spine, Branch], 6);
    robot.discover(150).unwrap();
    robot.run(2_000);
    robot.order(0, steer(Course::Left, 1));
    robot.run(1_000);
    for reset in 0..6 {
        robot.reset(1 + reset % 2);
        robot.run(600);
        let turning = (0..robot.len()).any(|module| robot.course(module) != Course::Ahead);
        assert_eq!(turning, reset == 0, "{} ms after the order", 1_000 + 600 * (reset + 1));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(32) })]

    /// The modules may form any loops.
    #[test]
    fn an_order_reaches_every_module_and_ends(
        links in prop::collection::vec((0..12_usize, 0..6_usize, 0..12_usize, 0..6_usize), 0..40),
        from in 0..12_usize,
        seed: u64,
    ) {
        let mut robot = Robot::new(Caterpillar.gait(), 12, seed);
        for (one, dock, other, its_dock) in links {
            let (one, other) = ((one, Dock::ALL[dock]), (other, Dock::ALL[its_dock]));
            if one.0 != other.0 && robot.wire(one).is_none() && robot.wire(other).is_none() {
                robot.attach(one, other);
            }
        }
        prop_assert!(robot.discover(150).is_some());
        // At first all modules tell each other the standing orders.
        robot.run(50);
        prop_assert_eq!(robot.orders_under_way(), 0);
        robot.order(from, steer(Course::Left, 7));
        robot.order(from, walk(FourLegs, 8));
        robot.run(30);
        prop_assert_eq!(robot.orders_under_way(), 0);
        for module in robot.attached_to(from) {
            prop_assert_eq!(robot.course(module), Course::Left);
            prop_assert_eq!(robot.gait(module), Some(FourLegs));
        }
    }
}
