//! Tests that PINx of the ATmega128 is read-only, and that on later parts a write to it toggles PORTx.

mod common;

use std::sync::Arc;

use common::{build_for, marked};
use simavr_harness::{Mcu, Part, State};

#[test]
fn a_write_to_pinx_toggles_portx_on_later_parts_alone() {
    for (part, ports, level) in [(Part::ATMEGA128, 7, 0x05), (Part::ATMEGA328P, 2, 0x1a)] {
        let image = build_for(part, "pins.c", &[]);
        let undecoded = Arc::new(Arc::unwrap_or_clone(image.clone()).undecoded());
        for image in [image, undecoded] {
            let mut mcu = Mcu::new(part, image, 1).expect("the image fits the part");
            assert_eq!(mcu.run_to_end(10_000), State::Done);
            assert_eq!(marked(&mcu), [level; 2].repeat(ports), "{}", part.name);
        }
    }
}
