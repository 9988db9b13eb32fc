//! The watchdog resets what hangs, and nothing else. Loads under which nothing must be reset are those of
//! `./x bench module`.

use plants::joint::Joint;
use simavr_harness::bench::module::watchdog_recovery;
use simavr_harness::{Controller, Engine, RobotBuilder};
use superbot_tests_simavr::{MILLISECOND, firmware, images};
use tasks::motor::Axis;

#[test]
fn an_mcu_with_a_task_that_hangs_is_back_within_half_a_second() {
    let milliseconds = watchdog_recovery(&images()).unwrap_or_else(|error| panic!("{error}"));
    assert!(milliseconds <= 500.0, "{milliseconds}");
}

/// Timer2's compare interrupt, in TIMSK.
const TIMSK: u16 = 0x57;
const OCIE2: u8 = 1 << 7;

/// What an image says of its start: WDRF of MCUCSR.
const BY_WATCHDOG: u8 = 1 << 3;

fn resets(engine: &Engine) -> [u64; 2] {
    let module = engine.robot().module(0).expect("there is one");
    Controller::ALL.map(|mcu| module.mcu(mcu).resets())
}

#[test]
fn a_task_whose_clock_stops_is_reset() {
    for (number, mcu) in Controller::ALL.into_iter().enumerate() {
        let mut robot = RobotBuilder::chain(firmware(), 3).seed(1).build().expect("three can be built");
        for module in 0..3 {
            let body = robot.module_mut(module).expect("there are three").body_mut();
            Axis::ALL.into_iter().for_each(|axis| *body.joint_mut(axis) = Joint::at(30.0));
        }
        let mut engine = Engine::new(robot, 1);
        engine.run_until(800 * MILLISECOND);
        assert_eq!(resets(&engine), [0, 0]);
        let module = engine.robot_mut().module_mut(0).expect("there is one");
        let enabled = module.mcu(mcu).read(TIMSK).expect("it is a register");
        assert!(enabled & OCIE2 != 0, "the {mcu:?}'s joint does not move");
        module.mcu_mut(mcu).write(TIMSK, enabled & !OCIE2);
        engine.run_until(engine.cycle() + 200 * MILLISECOND);
        let mut expected = [0, 0];
        expected[number] = 1;
        assert_eq!(resets(&engine), expected);
        let module = engine.robot().module(0).expect("there is one");
        let cause = module.mcu(mcu).read_symbol("RESET_CAUSE").expect("both images have it");
        assert!(cause[0] & BY_WATCHDOG != 0, "{cause:?}");
    }
}
