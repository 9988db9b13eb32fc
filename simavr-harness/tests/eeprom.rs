//! Tests the duration of writes to the EEPROM, and EE_READY.

use crate::common::{build_with, marked, mcu, mcu_of};
use simavr_harness::{Mcu, Part, Reset, State};

const EEWE: u8 = 0x02;

/// The duration of a write, 8448 us, in cycles.
const WRITE: u64 = 135_168;

fn cycle(mcu: &Mcu, value: u8) -> u64 {
    mcu.markers().iter().find(|marker| marker.value == value).expect("it is marked").cycle
}

fn a_write_takes(part: &'static Part, write: u64) {
    let mut mcu = mcu_of(part, "eeprom.c", &[]);
    assert_eq!(mcu.run_to_end(2 * write), State::Done);
    assert_eq!(marked(&mcu), [1, 2, EEWE, 0xaa, 0, 3, 4, 0x5a]);
    let (begun, ready) = (cycle(&mcu, 2), cycle(&mcu, 0xaa));
    // The response from sleep, `jmp`, and the registers that the handler saves before its marker.
    assert!((write..write + 40).contains(&(ready - begun)), "{}", ready - begun);
    assert!(mcu.awake_cycles() < 1000, "it slept meanwhile");
    let end = mcu.eeprom().len(); // addresses begin anew there
    assert_eq!((mcu.eeprom()[0xabc % end], mcu.eeprom()[0x123]), (0x5a, 0xff));
}

#[test]
fn a_write_takes_8448_us_and_then_ee_ready_fires() {
    a_write_takes(Part::ATMEGA128, WRITE);
}

#[test]
fn a_write_takes_3296_us_on_later_parts() {
    for part in [Part::ATMEGA328P, Part::ATMEGA1284P, Part::ATMEGA2560] {
        a_write_takes(part, 3296 * 16);
    }
}

/// Later parts write alone, which clears bits, or erase alone (table "EEPROM Mode Bits").
#[test]
fn later_parts_erase_or_write_alone() {
    for part in [Part::ATMEGA328P, Part::ATMEGA1284P, Part::ATMEGA2560] {
        let mut mcu = mcu_of(part, "eeprom.c", &["MODES"]);
        assert_eq!(mcu.run_to_end(2 * WRITE), State::Done);
        assert_eq!(marked(&mcu), [1, 2, 0, 0x3c, 1, 2, 0x20, 0x0c, 1, 2, 0x10, 0xff]);
        for (took, micros) in mcu.markers().chunks(4).zip([3296, 1800, 1800]) {
            let (took, expected) = (took[1].cycle - took[0].cycle, micros * 16);
            assert!((expected..expected + 30).contains(&took), "{took}, not {expected}");
        }
    }
}

#[test]
fn the_core_waits_2_cycles_for_a_write_and_4_for_a_read() {
    let mut mcu = mcu(&build_with("eeprom.c", &[]));
    mcu.run_to_end(2 * WRITE);
    let between = |from, to| cycle(&mcu, to) - cycle(&mcu, from);
    // `sbi` twice, the new mark's `ldi`, and `out`.
    assert_eq!(between(1, 2), 2 + 2 + 1 + 1 + 2);
    assert_eq!(between(3, 4), 2 + 1 + 1 + 4);
}

#[test]
fn interrupts_come_in_time_though_the_core_waits_for_reads() {
    const MILLISECOND: u64 = 16_000;
    let mut mcu = mcu(&build_with("timer.c", &["SCAN"]));
    mcu.run_until(50 * MILLISECOND);
    let cycles: Vec<u64> = mcu.markers().iter().map(|marker| marker.cycle).collect();
    assert!(cycles.len() > 45);
    // An instruction and its wait take 6 cycles.
    for (tick, cycle) in (0..).zip(&cycles) {
        let late = cycle - (cycles[0] + tick * MILLISECOND).saturating_sub(6);
        assert!(late <= 12, "{cycles:?}");
    }
}

fn nothing_is_written_with(define: &str) {
    let mut mcu = mcu(&build_with("eeprom.c", &[define]));
    assert_eq!(mcu.run_to_end(WRITE), State::Done);
    assert_eq!(marked(&mcu), [0, 0xaa, 0, 3, 4, 0xff]);
    assert!(mcu.eeprom().iter().all(|byte| *byte == 0xff));
}

#[test]
fn eewe_counts_only_within_four_cycles_of_eemwe() {
    nothing_is_written_with("LATE");
}

/// "Write a logical one to the EEMWE bit while writing a zero to EEWE" (section "The EEPROM Control
/// Register").
#[test]
fn eemwe_is_not_set_together_with_eewe() {
    nothing_is_written_with("TOGETHER");
}

#[test]
fn a_reset_does_not_end_a_write() {
    let mut mcu = mcu(&build_with("eeprom.c", &[]));
    let begun = mcu.run_to_marker(2, 1000).expect("it writes").cycle;
    mcu.run_until(begun + WRITE / 2);
    mcu.take_markers();
    mcu.reset(Reset::External);
    assert_eq!(mcu.run_to_end(2 * WRITE), State::Done);
    // The second write comes during the first, and is ignored.
    assert_eq!(marked(&mcu), [1, 2, EEWE, 0xaa, 0, 3, 4, 0x5a]);
    let ready = cycle(&mcu, 0xaa);
    assert!((WRITE..WRITE + 40).contains(&(ready - begun)), "{}", ready - begun);
}
