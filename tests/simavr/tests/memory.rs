//! A robot whose modules are all reset walks on by the gait that their EEPROMs keep.

use hormone::action::Action::{Straight, Wave};
use simavr_harness::{Engine, RobotBuilder};
use simulation::{Change, Face, Mcus, Robot, Shape};
use superbot_tests_simavr::{MILLISECOND, firmware};
use tasks::dock::Dock::Up;

const MODULES: usize = 3;
const SECOND: u64 = 1000 * MILLISECOND;

/// What modules do some seconds after all were reset, so long after an order to walk as a caterpillar.
fn after_reset(wait: u64) -> Vec<hormone::action::Action> {
    let wiring = Shape::Chain.wiring(MODULES).expect("there are enough");
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(1).build().expect("it can be built");
    let mut engine = Engine::new(robot, 2);
    engine.run_until(SECOND);
    let order = Change::Command { at: Face { module: 0, dock: Up }, payload: vec![0xd2, 1, 255] };
    engine.robot_mut().change(&order).expect("it can happen");
    engine.run_until(SECOND + wait);
    for module in 0..MODULES {
        engine.robot_mut().change(&Change::Reset { module, mcus: Mcus::Both }).expect("it can happen");
    }
    engine.run_until(SECOND + wait + 4 * SECOND);
    (0..MODULES - 1).filter_map(|module| engine.status(module)).map(|status| status.action).collect()
}

#[test]
fn a_robot_of_which_all_were_reset_goes_on_as_it_was_ordered() {
    assert_eq!(after_reset(SECOND), [Wave; MODULES - 1]);
}

/// A record takes 60 ms to write.
#[test]
fn a_record_that_was_not_written_to_its_end_does_not_count() {
    assert_eq!(
        after_reset(45 * MILLISECOND),
        [Straight; MODULES - 1],
        "they begin with the centipede's gait"
    );
}
