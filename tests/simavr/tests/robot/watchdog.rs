//! The watchdog resets an MCU with a task that hangs, and no other; until then the other tasks go on.
//! `./x bench module` has the loads under which nothing must be reset.

use plants::joint::Joint;
use simavr_harness::bench::module::watchdog_recovery;
use simavr_harness::{Controller, Engine, Place, RobotBuilder};
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

/// WDRF of MCUCSR, in an image's record of its start.
const BY_WATCHDOG: u8 = 1 << 3;

fn resets(engine: &Engine, module: usize) -> [u64; 2] {
    let module = engine.robot().module(module).expect("there is one");
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
        assert_eq!(resets(&engine, 0), [0, 0]);
        let module = engine.robot_mut().module_mut(0).expect("there is one");
        let enabled = module.mcu(mcu).read(TIMSK).expect("it is a register");
        assert!(enabled & OCIE2 != 0, "the {mcu:?}'s joint does not move");
        module.mcu_mut(mcu).write(TIMSK, enabled & !OCIE2);
        engine.run_until(engine.cycle() + 200 * MILLISECOND);
        let mut expected = [0, 0];
        expected[number] = 1;
        assert_eq!(resets(&engine, 0), expected);
        let module = engine.robot().module(0).expect("there is one");
        let cause = module.mcu(mcu).read_symbol("RESET_CAUSE").expect("both images have it");
        assert!(cause[0] & BY_WATCHDOG != 0, "{cause:?}");
    }
}

/// The time, in ms, in which the watchdog does not reset the MCU: it waits for 0.11 s, of which up to 50 ms
/// have passed.
const BEFORE: u64 = 60;

#[test]
fn while_hormone_hangs_neighbours_are_heard_and_probed_and_joints_controlled() {
    let firmware = firmware();
    let (_, stack) = firmware
        .master
        .symbols()
        .find(|(name, _)| name.contains("5stack7HORMONE"))
        .expect("the master's image has a stack for HORMONE");
    let Place::Data(start) = stack.place else { panic!("a stack is no code") };
    let stack = start..start + stack.size;
    let rules = |pc| firmware.master.function_at(pc).is_some_and(|(name, _)| name.contains("10controller"));
    let mut engine =
        Engine::new(RobotBuilder::chain(firmware.clone(), 3).seed(1).build().expect("it is one"), 1);
    engine.run_until(2000 * MILLISECOND);
    let hangs = |engine: &mut Engine| {
        let module = engine.robot_mut().module_mut(1).expect("there are three");
        let mcu = module.mcu_mut(Controller::Master);
        stack.contains(&mcu.stack_pointer()) && rules(mcu.pc()) && mcu.hang()
    };
    while !hangs(&mut engine) {
        assert!(engine.cycle() < 6000 * MILLISECOND, "HORMONE does not run");
        engine.run_until(engine.cycle() + 160);
    }
    // The first counts of each symbol: docs/inside.md lists them.
    let count = |engine: &Engine, symbol: &str, index: usize| {
        let master = engine.robot().module(1).expect("there are three").mcu(Controller::Master);
        let bytes = master.read_symbol(symbol).expect("the image has it");
        u16::from_le_bytes([bytes[2 * index], bytes[2 * index + 1]])
    };
    const LINKS: [&str; 3] = ["LINK_USART0", "LINK_USART1", "LINK_SOFT_UART"];
    let counts = |engine: &Engine| {
        let sent = LINKS.map(|link| count(engine, link, 0));
        let (heard, hormones) = (count(engine, LINKS[0], 1), count(engine, "MODULE_STATUS", 0));
        (sent, heard, hormones, count(engine, "MOTORS", 0), count(engine, "MOTORS", 1))
    };
    let (sent, heard, hormones, periods, missed) = counts(&engine);
    engine.run_until(engine.cycle() + BEFORE * MILLISECOND);
    assert_eq!(resets(&engine, 1), [0, 0]);
    let after = counts(&engine);
    assert_eq!(after.2, hormones, "HORMONE goes on");
    assert!(sent.iter().zip(after.0).all(|(&before, after)| after != before), "{sent:?} {:?}", after.0);
    assert_ne!(after.1, heard, "the neighbour's probes");
    // A spine's joints are at rest, or are controlled each millisecond.
    let controlled = after.3.wrapping_sub(periods);
    assert!(
        after.4 == missed && (controlled == 0 || u64::from(controlled) >= BEFORE - 5),
        "{controlled} periods"
    );
}
