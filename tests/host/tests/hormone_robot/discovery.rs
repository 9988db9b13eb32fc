//! Modules find their neighbours and their types, and notice a loss, in time.

use hormone::gait::GaitName::Centipede;
use hormone::module_type::ModuleType;
use hormone::schedule::PROBE_PERIOD;
use hormone::topology::UNKNOWN_FOR;
use tasks::dock::Dock::{Back, Front, Left};

use crate::robot::{Random, Robot, Segment, hundred_modules};

/// Milliseconds within which a neighbour is found and a loss is noticed.
const FOUND: u32 = 150;
const LOST: u32 = 300;

#[test]
fn a_hundred_modules_find_their_types_in_any_order_of_the_body() {
    for seed in 0..5 {
        let body = hundred_modules(seed);
        let mut robot = Robot::with_body(Centipede.gait(), &body, seed);
        robot.longest_delay = 5;
        let took = robot.discover(FOUND).expect("every type within 150 ms");
        assert!(took > 5, "probes take time");
        let types: Vec<ModuleType> = (0..robot.len()).map(|module| robot.module_type(module)).collect();
        assert_eq!(types, Robot::planned_types(&body));
        let count = |wanted| types.iter().filter(|&&module_type| module_type == wanted).count();
        assert_eq!([count(ModuleType::Branch), count(ModuleType::Spine)], [24, 26]);
        assert_eq!([count(ModuleType::LeftLeg), count(ModuleType::RightLeg)], [24, 24]);
    }
}

#[test]
fn an_answer_at_once_spares_the_wait_for_the_next_turn() {
    for seed in 0..20 {
        let mut robot = Robot::new(Centipede.gait(), 2, seed);
        robot.run(200);
        robot.attach((0, Back), (1, Front));
        let took = robot.discover(FOUND).unwrap();
        // The first probe of either end, its answer, and the answer to that: a millisecond each.
        assert!(took <= u32::from(PROBE_PERIOD) + 3, "{took} ms");
    }
}

#[test]
fn the_topology_holds_with_probes_lost() {
    let mut robot = Robot::with_body(Centipede.gait(), &hundred_modules(1), 1);
    robot.longest_delay = 5;
    robot.frame_loss = 5;
    robot.discover(1_000).expect("found in spite of lost probes");
    for _ in 0..3_000 {
        robot.run(5);
        assert!(robot.knows_itself(), "at {} ms", robot.now);
    }
}

#[test]
fn a_loss_is_noticed_in_time_and_not_before_six_probes_are_missing() {
    let mut robot = Robot::with_body(Centipede.gait(), &[], 3);
    robot.discover(FOUND).unwrap();
    robot.run(1_000);
    robot.detach((0, Back));
    let noticed = robot.discover(LOST).expect("within 300 ms");
    assert!(noticed >= 200, "after {noticed} ms");
}

#[test]
fn with_a_dock_blind_in_one_direction_neither_end_counts_the_other() {
    for blind in [(0, Back), (1, Front)] {
        let mut robot = Robot::with_body(Centipede.gait(), &[], 4);
        robot.blind.push(blind);
        robot.run(1_000);
        assert_eq!([robot.neighbours(0), robot.neighbours(1)], [[None; 6]; 2]);

        robot.blind.clear();
        robot.discover(FOUND).expect("found once both directions carry");
        robot.run(2 * u32::from(UNKNOWN_FOR));

        robot.blind.push(blind);
        robot.run(LOST);
        assert_eq!([robot.neighbours(0), robot.neighbours(1)], [[None; 6]; 2], "lost at both ends");
    }
}

#[test]
fn a_dock_that_goes_blind_while_the_robot_walks_is_missed_at_both_ends_in_time() {
    let mut random = Random::new(5);
    let mut longest = 0;
    for seed in 0..60 {
        let mut robot = Robot::with_body(Centipede.gait(), &[Segment::Branch, Segment::Spine], seed);
        robot.longest_delay = 3;
        robot.discover(FOUND).unwrap();
        robot.run(1_000);
        for blind in [(0, Back), (1, Front), (1, Left), (2, Back), (4, Back), (5, Front)] {
            robot.run(1_000 + random.below(500) as u32);
            robot.blind.push(blind);
            longest = longest.max(robot.discover(400).expect("it is lost"));
            robot.blind.clear();
            robot.discover(2 * FOUND).expect("found once both directions carry");
        }
    }
    assert!(longest <= LOST, "after {longest} ms");
}
