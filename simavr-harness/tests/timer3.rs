//! Tests of Timer3 (ATmega128 datasheet, "16-bit Timer/Counter"): its counter is set by the program.

mod common;

use common::{build_with, mcu};
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
