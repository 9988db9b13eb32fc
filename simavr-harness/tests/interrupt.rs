//! Tests the response time of interrupts, and when they fire, against the datasheet.

use crate::common::{build_with, marked, mcu, mcu_of};
use simavr_harness::{Mcu, Part, Pin, State};

const HANDLER: u8 = 0xaa;

/// The pin of the external interrupt that the fixture enables: INT4, INT0 on parts other than the ATmega128.
fn pin(part: &Part) -> Pin {
    let (port, bit) = match part.name {
        "atmega128" => ('E', 4),
        "atmega2560" => ('D', 0),
        _ => ('D', 2),
    };
    Pin { port, bit }
}

/// Runs the fixture past marker 1 and raises the pin. Returns the cycle of that edge, too.
fn run_with_edge(part: &'static Part, variant: &str) -> (Mcu, u64) {
    let mut mcu = mcu_of(part, "interrupt.S", &[variant]);
    mcu.run_to_marker(1, 1000).expect("the program reaches marker 1");
    // Past the `out`, and past the `sleep` where there is one.
    mcu.run_until(mcu.cycle() + 10);
    let edge = mcu.cycle();
    mcu.drive_pin(pin(part), true);
    (mcu, edge)
}

/// Cycles from the edge to the handler's first instruction.
fn latency(part: &'static Part, variant: &str) -> u64 {
    let (mut mcu, edge) = run_with_edge(part, variant);
    let handler = mcu.run_to_marker(HANDLER, 1000).expect("the handler runs");
    handler.cycle - edge
}

#[test]
fn response_takes_4_cycles_and_the_vectors_jmp_3() {
    for part in [Part::ATMEGA128, Part::ATMEGA328P, Part::ATMEGA1284P] {
        assert_eq!(latency(part, "AWAKE"), 7, "{}", part.name);
    }
}

#[test]
fn response_from_sleep_takes_4_cycles_more() {
    for part in [Part::ATMEGA128, Part::ATMEGA328P, Part::ATMEGA1284P] {
        assert_eq!(latency(part, "ASLEEP"), 11, "{}", part.name);
    }
}

/// "Five clock cycles minimum", and five more from sleep (ATmega2560 datasheet, "Interrupt Response Time").
#[test]
fn response_with_a_program_counter_of_3_bytes_takes_5_cycles() {
    assert_eq!(latency(Part::ATMEGA2560, "AWAKE"), 8);
    assert_eq!(latency(Part::ATMEGA2560, "ASLEEP"), 13);
}

#[test]
fn a_flag_latched_while_masked_fires_when_unmasked() {
    for part in Part::ALL {
        let (mut mcu, _) = run_with_edge(part, "MASKED");
        assert_eq!(mcu.run_to_end(1000), State::Done);
        assert_eq!(marked(&mcu), [1, 2, HANDLER, 3], "{}", part.name);
    }
}

#[test]
fn a_one_written_to_eifr_clears_the_flag() {
    for part in Part::ALL {
        let (mut mcu, _) = run_with_edge(part, "CLEARED");
        assert_eq!(mcu.run_to_end(1000), State::Done);
        assert_eq!(marked(&mcu), [1, 2, 3], "{}", part.name);
    }
}

#[test]
fn a_timers_flag_latched_while_masked_fires_when_unmasked() {
    let markers = |defines: &[&str]| {
        let mut mcu = mcu(&build_with("compare.c", defines));
        assert_eq!(mcu.run_to_end(10_000), State::Done);
        marked(&mcu)
    };
    assert_eq!(markers(&[]), [1, HANDLER, 2]);
    assert_eq!(markers(&["CLEARED"]), [1, 2]);
}

#[test]
fn an_interrupt_withdrawn_before_it_is_accepted_does_not_keep_the_core_awake() {
    let mut mcu = mcu(&build_with("compare.c", &["WITHDRAWN"]));
    assert_eq!(mcu.run_to_end(10_000), State::Sleeping);
    assert_eq!(marked(&mcu), [1]);
}
