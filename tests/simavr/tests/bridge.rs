//! The bridge between the MCUs of a module: how much it carries, and what it survives.

use simavr_harness::{CLOCK_HZ, Controller, Engine, Images, RobotBuilder};
use superbot_tests_simavr::{MILLISECOND, image};

/// Cycles that a message of 16 bytes takes on the wire at 400 kHz: START, address, 20 bytes with an acknowledgement each,
/// STOP.
const WIRE: u64 = (1 + 21 * 9 + 1) * CLOCK_HZ as u64 / 400_000;

/// A master that sends messages to its slave as fast as the bridge takes them.
fn pair() -> Engine {
    let images = Images { master: image("bench_bridge_a"), slave: image("bench_bridge_b") };
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
    let mut engine = pair();
    engine.run_until(100 * MILLISECOND);
    let before = symbol(&engine, Controller::Slave, "IN_TURN");
    engine.run_until(1_100 * MILLISECOND);
    let messages = symbol(&engine, Controller::Slave, "IN_TURN") - before;
    let efficiency = f64::from(messages) * WIRE as f64 / f64::from(CLOCK_HZ);
    println!("{messages} messages a second, {efficiency:.3} of the wire's limit");
    assert_eq!(symbol(&engine, Controller::Slave, "OUT_OF_TURN"), 0);
    assert!(efficiency >= 0.8, "{efficiency}");
}
