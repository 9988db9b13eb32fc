//! Tests that PINx of the ATmega128 is read-only, and that on later parts a write to it toggles PORTx.
//! Pins that a part does not have, and addresses without a register, do nothing.

use std::sync::Arc;

use crate::common::{build_for, marked, mcu_of};
use simavr_harness::{Image, Mcu, Part, Pin, State};

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

#[test]
fn a_pin_that_a_part_does_not_have_does_nothing() {
    for part in Part::ALL {
        let mut mcu = mcu_of(part, "pins.c", &[]);
        for port in 'A'..='Z' {
            let pin = Pin { port, bit: 7 };
            mcu.add_probe(pin);
            mcu.drive_pin(pin, true);
            mcu.drive_pin(pin, false);
        }
        assert!(!mcu.pin(Pin { port: 'Z', bit: 7 }));
        assert_eq!(mcu.run_to_end(10_000), State::Done, "{}", part.name);
    }
}

/// The same image, to be executed by both interpreters.
fn twice(part: &Part, defines: &[&str]) -> [Arc<Image>; 2] {
    let image = build_for(part, "reserved.c", defines);
    let undecoded = Arc::new(Arc::unwrap_or_clone(image.clone()).undecoded());
    [image, undecoded]
}

#[test]
fn a_program_may_write_where_a_part_has_no_register() {
    for part in Part::ALL {
        for image in twice(part, &[]) {
            let mut mcu = Mcu::new(part, image, 1).expect("the image fits the part");
            assert_eq!(mcu.run_to_end(10_000), State::Done);
            assert_eq!(marked(&mcu), [1]);
        }
    }
}

#[test]
fn elpm_crashes_a_program_for_a_part_without_rampz() {
    for image in twice(Part::ATMEGA328P, &["ELPM"]) {
        let mut mcu = Mcu::new(Part::ATMEGA328P, image, 1).expect("the image fits the part");
        let end = mcu.run_to_end(10_000);
        assert!(matches!(&end, State::Crashed(reason) if reason.contains("Invalid Opcode")), "{end:?}");
    }
}
