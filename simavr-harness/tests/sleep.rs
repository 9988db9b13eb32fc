//! Tests that sleep is passed in one jump, exact to the cycle.

use crate::common::{build, mcu};
use simavr_harness::bench::simulator::instructions;

const MILLISECOND: u64 = 16_000;

#[test]
fn a_tick_comes_every_16000_cycles() {
    let mut mcu = mcu(&build("timer.c"));
    mcu.run_until(100 * MILLISECOND);
    let ticks: Vec<_> = mcu.markers().iter().map(|marker| marker.cycle).collect();
    assert_eq!(ticks.len(), 99);
    assert!(ticks.windows(2).all(|pair| pair[1] - pair[0] == MILLISECOND), "{ticks:?}");
    // A round: response from sleep 8, jmp 3, out 1, reti 4, rjmp 2, sleep 1. And the start-up.
    let start_up = mcu.awake_cycles() - 99 * 19;
    assert!((10..60).contains(&start_up), "{start_up}");
}

#[test]
fn instructions_are_counted_through_sleep() {
    let executed = instructions(&mut mcu(&build("timer.c")), 100 * MILLISECOND);
    // A round: jmp, out, reti, rjmp, sleep. And the start-up.
    let start_up = executed - 99 * 5;
    assert!((5..60).contains(&start_up), "{start_up}");
}

#[test]
fn how_a_run_is_cut_changes_nothing() {
    let image = build("timer.c");
    let end = 20 * MILLISECOND + 123;
    let run_in = |step: u64| {
        let mut mcu = mcu(&image);
        while mcu.cycle() < end {
            mcu.run_until((mcu.cycle() + step).min(end));
        }
        (mcu.state_hash(), mcu.take_markers(), mcu.awake_cycles())
    };
    let whole = run_in(end);
    for step in [1, 3, 50, 977, MILLISECOND] {
        assert_eq!(run_in(step), whole, "step {step}");
    }
}
