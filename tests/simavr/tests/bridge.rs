//! The bridge between the MCUs of a module: its throughput, and the faults that it survives.

use std::mem::offset_of;
use std::num::NonZeroU32;

use simavr_harness::bench::module::bridge_efficiency;
use simavr_harness::{Controller, Engine, Images, Reset, RobotBuilder};
use simulation::START_UP;
use superbot_tests_simavr::{MILLISECOND, image, test_images};
use tasks::bridge::protocol::BridgeCounters;

/// A master that sends messages to its slave as fast as the bridge takes them.
fn pair() -> Engine {
    pair_of("bench_bridge")
}

fn pair_of(images: &str) -> Engine {
    let images = Images { master: image(&format!("{images}_a")), slave: image(&format!("{images}_b")) };
    let robot = RobotBuilder::new(images, 1).seed(1).build().expect("one module can be built");
    Engine::new(robot, 1)
}

fn symbol(engine: &Engine, controller: Controller, name: &str) -> u16 {
    let module = engine.robot().module(0).expect("there is one");
    let bytes = module.mcu(controller).read_symbol(name).expect("the image has it");
    u16::from_le_bytes([bytes[0], bytes[1]])
}

#[test]
fn messages_take_four_fifths_of_what_the_wire_can_carry() {
    let efficiency = bridge_efficiency(&test_images()).unwrap_or_else(|error| panic!("{error}"));
    assert!(efficiency >= 0.8, "{efficiency}");
}

/// A count of one side's bridge, by its offset.
fn count(engine: &Engine, side: Controller, offset: usize) -> u16 {
    let module = engine.robot().module(0).expect("there is one");
    let counters = module.mcu(side).read_symbol("BRIDGE").expect("the image has it");
    u16::from_le_bytes([counters[offset], counters[offset + 1]])
}

/// The time after the end of a fault within which the bus must carry messages again.
const RECOVERY: u64 = START_UP + 20 * MILLISECOND;

/// Asserts that at least one message comes within `RECOVERY`, and that none comes out of turn.
fn assert_in_service(engine: &mut Engine, when: &str) {
    let [before, lost] = ["IN_TURN", "OUT_OF_TURN"].map(|name| symbol(engine, Controller::Slave, name));
    engine.run_until(engine.cycle() + RECOVERY);
    let [after, lost_now] = ["IN_TURN", "OUT_OF_TURN"].map(|name| symbol(engine, Controller::Slave, name));
    assert!(after != before, "{when}: nothing has come");
    assert_eq!(lost_now, lost, "{when}: a message is missing");
}

#[test]
fn a_bus_that_is_stuck_is_freed() {
    let mut engine = pair();
    engine.run_until(50 * MILLISECOND);
    for clocks in (1..=9).filter_map(NonZeroU32::new) {
        // The fault begins at any moment of a transfer.
        engine.run_until(engine.cycle() + 12_345);
        engine.robot_mut().module_mut(0).expect("there is one").hold_data_wire(clocks);
        assert_in_service(&mut engine, &format!("{clocks} clocks"));
    }
    assert_eq!(count(&engine, Controller::Master, offset_of!(BridgeCounters, freed)), 9);
    assert_eq!(count(&engine, Controller::Master, offset_of!(BridgeCounters, gave_up)), 0);
}

/// A joint's order is said once. However long the bus is stuck, it is only late.
#[test]
fn nothing_is_lost_while_the_bus_is_stuck() {
    let mut engine = pair();
    engine.run_until(50 * MILLISECOND);
    for _ in 0..400 {
        engine.robot_mut().module_mut(0).expect("there is one").hold_data_wire(NonZeroU32::MAX);
        engine.run_until(engine.cycle() + MILLISECOND);
    }
    let freed = count(&engine, Controller::Master, offset_of!(BridgeCounters, freed));
    assert!(freed > 20, "{freed}");
    engine.robot_mut().module_mut(0).expect("there is one").hold_data_wire(NonZeroU32::MIN);
    assert_in_service(&mut engine, "held for 400 ms");
    assert_eq!(count(&engine, Controller::Master, offset_of!(BridgeCounters, gave_up)), 0);
}

/// A side whose own packet waits frees the bus, too, and the other side's packet may be whole by then but for
/// its STOP. As that side does not send it again, it must not be lost.
#[test]
fn nothing_is_lost_where_both_sides_send_on_a_bus_that_is_stuck() {
    let mut engine = pair_of("board_bridge");
    engine.run_until(50 * MILLISECOND);
    let in_turn = |engine: &Engine| Controller::ALL.map(|side| symbol(engine, side, "IN_TURN"));
    for number in 0..500 {
        engine.run_until(engine.cycle() + 977 * number % 14_000);
        engine.robot_mut().module_mut(0).expect("there is one").hold_data_wire(NonZeroU32::MIN);
        let before = in_turn(&engine);
        engine.run_until(engine.cycle() + 20 * MILLISECOND);
        let after = in_turn(&engine);
        assert!(before.iter().zip(after).all(|(before, after)| *before != after), "{number}: {after:?}");
    }
    for side in Controller::ALL {
        assert_eq!(symbol(&engine, side, "OUT_OF_TURN"), 0, "{side:?}");
        assert!(count(&engine, side, offset_of!(BridgeCounters, freed)) > 100, "{side:?}");
    }
}

#[test]
fn a_reset_of_either_side_is_recovered_from() {
    let mut engine = pair();
    engine.run_until(50 * MILLISECOND);
    for controller in Controller::ALL {
        for number in 0..20 {
            engine.run_until(engine.cycle() + 7_777 * number % 20_000);
            let module = engine.robot_mut().module_mut(0).expect("there is one");
            module.mcu_mut(controller).reset(Reset::External);
            let end = engine.cycle() + RECOVERY;
            engine.run_until(end - 5 * MILLISECOND);
            let received = offset_of!(BridgeCounters, messages_received);
            let before = count(&engine, Controller::Slave, received);
            engine.run_until(end);
            let after = count(&engine, Controller::Slave, received);
            assert!(after > before + 2, "reset {number} of the {controller:?}: {before}, {after}");
        }
    }
}

/// While one side is gone the other's messages are lost, and counted.
#[test]
fn what_is_lost_is_counted() {
    let mut engine = pair();
    engine.run_until(50 * MILLISECOND);
    let gone = engine.cycle() + 200 * MILLISECOND;
    while engine.cycle() < gone {
        let module = engine.robot_mut().module_mut(0).expect("there is one");
        module.mcu_mut(Controller::Slave).reset(Reset::External);
        engine.run_until(engine.cycle() + 1_000);
    }
    let gave_up = count(&engine, Controller::Master, offset_of!(BridgeCounters, gave_up));
    // Each message is tried 21 times, about a millisecond apart.
    assert!((5..=10).contains(&gave_up), "{gave_up}");
    engine.run_until(engine.cycle() + RECOVERY);
    let received = count(&engine, Controller::Slave, offset_of!(BridgeCounters, messages_received));
    assert!(received > 2, "{received}");
}
