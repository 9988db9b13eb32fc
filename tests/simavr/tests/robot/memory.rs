//! A robot whose modules are all reset walks on by the gait that their EEPROMs keep.

use std::mem::offset_of;

use hormone::action::Action::{Straight, Wave};
use simavr_harness::{Controller, Engine, RobotBuilder, WhileWriting};
use simulation::{Change, Face, Mcus, Robot, Shape};
use superbot_tests_simavr::{MILLISECOND, firmware};
use tasks::dock::Dock::Up;
use tasks::motor::task::Counters;

const MODULES: usize = 3;
const SECOND: u64 = 1000 * MILLISECOND;

fn chain() -> Engine {
    let wiring = Shape::Chain.wiring(MODULES).expect("there are enough");
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(1).build().expect("it can be built");
    Engine::new(robot, 2)
}

/// Orders to walk as a caterpillar.
fn order(engine: &mut Engine, number: u8, period: u8) {
    let order = Change::Command { at: Face { module: 0, dock: Up }, payload: vec![0xd2, number, period] };
    engine.robot_mut().change(&order).expect("it can happen");
}

/// The actions of the modules some seconds after all are reset.
fn after_reset(engine: &mut Engine) -> Vec<hormone::action::Action> {
    for module in 0..MODULES {
        engine.robot_mut().change(&Change::Reset { module, mcus: Mcus::Both }).expect("it can happen");
    }
    engine.run_until(engine.cycle() + 4 * SECOND);
    (0..MODULES - 1).filter_map(|module| engine.status(module)).map(|status| status.action).collect()
}

/// The same, with the reset `wait` cycles after an order.
fn after_order_and_reset(wait: u64) -> Vec<hormone::action::Action> {
    let mut engine = chain();
    engine.run_until(SECOND);
    order(&mut engine, 1, 255);
    engine.run_until(SECOND + wait);
    after_reset(&mut engine)
}

#[test]
fn a_robot_of_which_all_were_reset_goes_on_as_it_was_ordered() {
    assert_eq!(after_order_and_reset(SECOND), [Wave; MODULES - 1]);
}

/// Periods in which the masters have controlled their joints.
fn periods(engine: &Engine) -> [u16; MODULES] {
    std::array::from_fn(|module| {
        let mcu = engine.robot().module(module).expect("there is one").mcu(Controller::Master);
        let counters = mcu.read_symbol("MOTORS").expect("the image has it");
        u16::from_le_bytes([0, 1].map(|byte| counters[offset_of!(Counters, periods) + byte]))
    })
}

/// Only the chip itself can show what a write to the EEPROM does to the software interrupt. Joints that move
/// meanwhile miss two periods of three, and no more; the order is kept, and no MCU is reset.
fn a_robot_bears(disturbance: WhileWriting) {
    let mut engine = chain();
    for index in 0..MODULES {
        let module = engine.robot_mut().module_mut(index).expect("there is one");
        Controller::ALL.into_iter().for_each(|mcu| module.mcu_mut(mcu).disturb_spm(disturbance));
    }
    let mut moved = [[0; MODULES]; 2];
    for (number, period) in [(1, 255), (2, 40)] {
        engine.run_until(u64::from(number) * 2 * SECOND);
        order(&mut engine, number, period);
        moved = moved.map(|_| {
            let before = periods(&engine);
            engine.run_until(engine.cycle() + 100 * MILLISECOND);
            std::array::from_fn(|module| periods(&engine)[module].wrapping_sub(before[module]))
        });
    }
    let [writing, then] = moved;
    assert!(writing.iter().all(|periods| (30..60).contains(periods)), "{writing:?}");
    assert!(then.iter().all(|periods| (99..=101).contains(periods)), "{then:?}");
    let modules = (0..MODULES).filter_map(|module| engine.robot().module(module));
    let resets: u64 = modules.flat_map(|module| Controller::ALL.map(|mcu| module.mcu(mcu).resets())).sum();
    assert_eq!(resets, 0);
    assert_eq!(after_reset(&mut engine), [Wave; MODULES - 1]);
}

#[test]
fn a_robot_bears_a_software_interrupt_that_waits_for_the_eeprom() {
    a_robot_bears(WhileWriting::Waits);
}

#[test]
fn a_robot_bears_a_software_interrupt_that_the_eeprom_keeps_on_or_off() {
    a_robot_bears(WhileWriting::KeepsRegister);
}

/// A record takes 60 ms to write.
#[test]
fn a_record_that_was_not_written_to_its_end_does_not_count() {
    assert_eq!(
        after_order_and_reset(45 * MILLISECOND),
        [Straight; MODULES - 1],
        "they begin with the centipede's gait"
    );
}
