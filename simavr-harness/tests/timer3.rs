//! Tests of Timer3 (ATmega128 datasheet, "16-bit Timer/Counter"): its counter is set by the program.

mod common;

use common::{build_with, mcu};

/// The first mark after that of the counter's setting, and the cycles between the two, in which it counts.
fn first(defines: &[&str]) -> (u8, u64) {
    let mut mcu = mcu(&build_with("timer3.c", defines));
    mcu.run_until(200_000);
    let [set, then] = mcu.markers().first_chunk().copied().expect("an interrupt comes");
    (then.value, then.cycle - set.cycle)
}

/// Whether an interrupt's mark comes after so many counts, and the interrupt's response and its handler.
fn is_about(cycles: u64, counts: u64) -> bool {
    (counts..counts + 50).contains(&cycles)
}

/// A write of the counter blocks a match on the timer's next clock (section "Compare Match Blocking by TCNTn
/// Write").
#[test]
fn a_write_of_the_counter_blocks_the_match_there() {
    let (mark, cycles) = first(&["COUNTER=900"]);
    assert!(mark == 2 && is_about(cycles, 100), "{mark} after {cycles}");
    let (mark, cycles) = first(&["COUNTER=1000"]);
    assert!(mark == 3 && is_about(cycles, 0x1_0000 - 1000), "{mark} after {cycles}");
}

/// A counter beyond its top counts on to 0xFFFF, and up to the top from 0.
#[test]
fn a_counter_beyond_its_top_comes_back() {
    for (top, mark, at) in [("TOP=500", 3, 500), ("TOP=2000", 2, 1000)] {
        let (found, cycles) = first(&["COUNTER=0x8000", top]);
        assert!(found == mark && is_about(cycles, 0x8000 + at), "{top}: {found} after {cycles}");
    }
}
