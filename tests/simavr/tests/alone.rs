//! The program of docs/kernel.md, "The kernel alone", which `./x test` builds as it stands there.

use std::sync::Arc;

use simavr_harness::{Image, Mcu, Part, Pin};
use superbot_tests_simavr::{MILLISECOND, images};

#[test]
fn it_toggles_its_pin_every_500_ms() {
    let image = Image::load(images().join("alone.elf")).expect("./x test builds it");
    let mut mcu = Mcu::new(Part::ATMEGA128, Arc::new(image), 1).expect("it fits the ATmega128");
    mcu.add_probe(Pin { port: 'B', bit: 0 });
    mcu.run_until(2600 * MILLISECOND);
    let edges: Vec<u64> = mcu.take_edges(0).iter().map(|edge| edge.cycle / MILLISECOND).collect();
    assert_eq!(edges.len(), 5, "edges after {edges:?} ms");
    let apart = edges.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(apart.clone().all(|ms| (499..=501).contains(&ms)), "edges after {edges:?} ms");
}
