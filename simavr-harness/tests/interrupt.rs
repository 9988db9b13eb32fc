//! Interrupts take their time, and fire when the datasheet says they do.

mod common;

use common::{build_with, marked, mcu};
use simavr_harness::{Mcu, Pin, State};

const INT4: Pin = Pin { port: 'E', bit: 4 };
const HANDLER: u8 = 0xaa;

/// Runs the fixture past marker 1 and lets an edge come; returns its cycle too.
fn run_with_edge(variant: &str) -> (Mcu, u64) {
    let mut mcu = mcu(&build_with("interrupt.S", &[variant]));
    mcu.run_to_marker(1, 1000).expect("the program reaches marker 1");
    // Past the `out`, and past the `sleep` where there is one.
    mcu.run_until(mcu.cycle() + 10);
    let edge = mcu.cycle();
    mcu.drive_pin(INT4, true);
    (mcu, edge)
}

/// Cycles from the edge to the handler's first instruction.
fn latency(variant: &str) -> u64 {
    let (mut mcu, edge) = run_with_edge(variant);
    let handler = mcu.run_to_marker(HANDLER, 1000).expect("the handler runs");
    handler.cycle - edge
}

#[test]
fn response_takes_4_cycles_and_the_vectors_jmp_3() {
    assert_eq!(latency("AWAKE"), 7);
}

#[test]
fn response_from_sleep_takes_4_cycles_more() {
    assert_eq!(latency("ASLEEP"), 11);
}

#[test]
fn a_flag_latched_while_masked_fires_when_unmasked() {
    let (mut mcu, _) = run_with_edge("MASKED");
    assert_eq!(mcu.run_to_end(1000), State::Done);
    assert_eq!(marked(&mcu), [1, 2, HANDLER, 3]);
}

#[test]
fn a_one_written_to_eifr_clears_the_flag() {
    let (mut mcu, _) = run_with_edge("CLEARED");
    assert_eq!(mcu.run_to_end(1000), State::Done);
    assert_eq!(marked(&mcu), [1, 2, 3]);
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
