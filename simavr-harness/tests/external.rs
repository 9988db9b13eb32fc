//! Tests of the ATmega128's external interrupts (datasheet, "External Interrupts"): every sense, at every
//! pin.

use crate::common::{build_with, marked, mcu};
use simavr_harness::{Mcu, Pin};

const EIFR: u16 = 0x58;
/// Cycles that suffice for whatever an edge leads to.
const SOON: u64 = 500;

fn pin(number: u8) -> Pin {
    Pin { port: if number < 4 { 'D' } else { 'E' }, bit: number }
}

/// A program that enables an interrupt with a sense (ISCn), run until it has.
fn program(number: u8, sense: u8, limit: &str) -> Mcu {
    let (register, shift) = if number < 4 { ("EICRA", 2 * number) } else { ("EICRB", 2 * (number - 4)) };
    let setup = format!("SETUP={register}={}; EIMSK={}", sense << shift, 1 << number);
    mcu(&build_with("external.c", &[&setup, limit]))
}

fn count(mcu: &Mcu, number: u8) -> usize {
    marked(mcu).into_iter().filter(|&mark| mark == 0x10 + number).count()
}

#[test]
fn edges_raise_interrupts_by_their_sense() {
    for number in 0..8 {
        for (sense, by_rise, by_fall) in [(1, 1, 1), (2, 0, 1), (3, 1, 0)] {
            if number < 4 && sense == 1 {
                continue; // reserved
            }
            let mut mcu = program(number, sense, "LIMIT=100");
            mcu.drive_pin(pin(number), false);
            mcu.run_to_marker(1, 10_000).expect("the interrupt is enabled");
            let mut change = |level| {
                let before = count(&mcu, number);
                mcu.drive_pin(pin(number), level);
                mcu.run_until(mcu.cycle() + SOON);
                count(&mcu, number) - before
            };
            for _ in 0..2 {
                assert_eq!((change(true), change(false)), (by_rise, by_fall), "INT{number}, sense {sense}");
            }
        }
    }
}

/// "If low level interrupt is selected, the low level must be held until the completion of the currently
/// executing instruction [...] will generate an interrupt request as long as the pin is held low."
#[test]
fn a_low_level_interrupts_as_long_as_it_lasts() {
    for number in 0..8 {
        let mut mcu = program(number, 0, "LIMIT=100");
        mcu.drive_pin(pin(number), true);
        mcu.run_to_marker(2, 20_000).expect("a high level does not interrupt");
        assert_eq!(count(&mcu, number), 0);
        mcu.drive_pin(pin(number), false);
        mcu.run_until(mcu.cycle() + SOON);
        assert!(count(&mcu, number) > 5, "INT{number}: {:?}", marked(&mcu));
        assert_eq!(mcu.read(EIFR).map(|flags| flags & 1 << number), Some(0), "a level has no flag");
        mcu.drive_pin(pin(number), true);
        mcu.run_until(mcu.cycle() + SOON);
        let before = count(&mcu, number);
        mcu.run_until(mcu.cycle() + SOON);
        assert_eq!(count(&mcu, number), before, "INT{number}");
    }
}

#[test]
fn a_level_that_was_low_before_interrupts_when_it_is_enabled() {
    for number in 0..8 {
        let mut mcu = program(number, 0, "LIMIT=3");
        mcu.drive_pin(pin(number), true);
        mcu.drive_pin(pin(number), false);
        mcu.run_until(20_000);
        let mark = 0x10 + number;
        assert_eq!(marked(&mcu), [1, mark, mark, mark, 2], "INT{number}");
    }
}

/// Nobody knows the level of a pin that floats. A program that raises the interrupt by itself relies on none.
#[test]
fn a_pin_that_floats_does_not_interrupt() {
    for number in 0..8 {
        let mut mcu = program(number, 0, "LIMIT=3");
        mcu.run_until(20_000);
        assert_eq!(marked(&mcu), [1, 2], "INT{number}");
    }
}
