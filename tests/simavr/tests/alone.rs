//! The programs of docs/own-program.md, which `./x test` builds as they stand there.

use std::sync::Arc;

use simavr_harness::{Image, Mcu, Part, Pin};
use superbot_tests_simavr::{MILLISECOND, images};

#[test]
fn alone_it_toggles_its_pin_every_500_ms() {
    assert_toggles("alone.elf", Part::ATMEGA128, 0);
}

#[test]
fn beside_avr_hal_it_toggles_its_pin_every_500_ms() {
    assert_toggles("beside/uno.elf", Part::ATMEGA328P, 5);
}

/// Asserts that the program toggles this pin of port B.
fn assert_toggles(program: &str, part: &'static Part, bit: u8) {
    let image = Image::load(images().join(program)).expect("./x test builds it");
    let mut mcu = Mcu::new(part, Arc::new(image), 1).expect("it fits the MCU");
    mcu.add_probe(Pin { port: 'B', bit });
    mcu.run_until(2600 * MILLISECOND);
    let edges: Vec<u64> = mcu.take_edges(0).iter().map(|edge| edge.cycle / MILLISECOND).collect();
    assert_eq!(edges.len(), 5, "edges after {edges:?} ms");
    let apart = edges.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(apart.clone().all(|ms| (499..=501).contains(&ms)), "edges after {edges:?} ms");
}
