//! Tests of Timer3 (ATmega128 datasheet, "16-bit Timer/Counter"): its counter is set by the program.

use crate::common::{build_with, mcu};
use simavr_harness::Pin;

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

/// The cycles between the marks of this value.
fn intervals(defines: &[&str], mark: u8) -> Vec<u64> {
    let mut mcu = mcu(&build_with("timer3.c", defines));
    mcu.run_until(50_000);
    let cycles: Vec<_> =
        mcu.markers().iter().filter(|marker| marker.value == mark).map(|marker| marker.cycle).collect();
    cycles.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

fn are_all(intervals: &[u64], cycles: u64) -> bool {
    // An interrupt waits for the end of an instruction, or of another's handler.
    intervals.len() > 5 && intervals.iter().all(|it| it.abs_diff(cycles) <= 50)
}

/// Without PWM the overflow is at 0xFFFF, with PWM at the top. If ICR3 is the top, the capture's flag is set
/// there (sections "Modes of Operation", "Input Capture Unit").
#[test]
fn in_each_mode_that_counts_up_the_counter_comes_to_its_top() {
    const MATCH: u8 = 2;
    const OVERFLOW: u8 = 3;
    const CAPTURE: u8 = 4;
    for (mode, top, marks) in [
        ("MODE=4", 2000, &[MATCH][..]),
        ("MODE=5", 0xff, &[OVERFLOW]),
        ("MODE=6", 0x1ff, &[OVERFLOW]),
        ("MODE=7", 0x3ff, &[OVERFLOW]),
        ("MODE=12", 2000, &[MATCH, CAPTURE]),
        ("MODE=14", 2000, &[OVERFLOW, CAPTURE]),
    ] {
        for mark in [OVERFLOW, CAPTURE, MATCH] {
            let found = intervals(&["COUNTER=0", "TOP=2000", mode], mark);
            assert!(
                if marks.contains(&mark) {
                    are_all(&found, top + 1)
                } else {
                    found.is_empty() || mark == MATCH
                },
                "{mode}, {mark}: {found:?}"
            );
        }
    }
}

#[test]
fn the_prescaler_divides_the_clock() {
    for (clock, divisor) in [("CLOCK=2", 8), ("CLOCK=3", 64), ("CLOCK=4", 256), ("CLOCK=5", 1024)] {
        let (mark, cycles) = first(&["COUNTER=900", clock]);
        let counts = cycles / divisor;
        assert!(mark == 2 && (99..=101 + 50 / divisor).contains(&counts), "{clock}: {mark} after {cycles}");
    }
}

/// A counter beyond its top counts on to 0xFFFF, and up to the top from 0.
#[test]
fn a_counter_beyond_its_top_comes_back() {
    for (top, mark, at) in [("TOP=500", 3, 500), ("TOP=2000", 2, 1000)] {
        let (found, cycles) = first(&["COUNTER=0x8000", top]);
        assert!(found == mark && is_about(cycles, 0x8000 + at), "{top}: {found} after {cycles}");
    }
}

/// OCR3A is the top of fast PWM here, so ICR3 is free to capture (section "Input Capture Unit").
#[test]
fn an_edge_is_captured_in_normal_mode_and_in_fast_pwm_up_to_ocr3a() {
    const CAPTURE: Pin = Pin { port: 'E', bit: 7 };
    const ICR3: [u16; 2] = [0x80, 0x81];
    for defines in [&["COUNTER=2000"][..], &["COUNTER=2000", "TOP=60000"]] {
        let mut mcu = mcu(&build_with("timer3.c", defines));
        let set = mcu.run_to_marker(1, 1_000).expect("the counter is set").cycle;
        mcu.drive_pin(CAPTURE, true);
        mcu.run_until(set + 5_000);
        let falls = mcu.cycle();
        mcu.drive_pin(CAPTURE, false);
        let captured = mcu.run_to_marker(4, 100).unwrap_or_else(|| panic!("{defines:?}: no capture"));
        assert!(captured.cycle < falls + 50);
        let counter = u16::from_le_bytes(ICR3.map(|address| mcu.read(address).expect("it is a register")));
        assert!(u64::from(counter).abs_diff(2_000 + falls - set) < 10, "{defines:?}: {counter}");
    }
}
