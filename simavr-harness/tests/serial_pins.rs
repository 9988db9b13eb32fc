//! Tests a serial port that a program makes of two pins, with bytes as edges.

use crate::common::{build_with, marked, mcu};
use simavr_harness::{Character, Mcu, Pin, Reset, SerialPinCounts, SerialPins};

/// 8N1 at 38400 baud: ten bits of 416 2/3 cycles.
const FRAME: u64 = 4166;

const PINS: SerialPins =
    SerialPins { receive: Pin { port: 'E', bit: 7 }, transmit: Pin { port: 'E', bit: 5 } };

/// The number of the port: after two USARTs.
const PORT: usize = 2;

fn with_pins(defines: &[&str]) -> Mcu {
    let mut mcu = mcu(&build_with("serial_pins.c", defines));
    mcu.add_serial_pins(PINS);
    mcu.run_until(FRAME);
    mcu
}

fn receive(mcu: &mut Mcu, value: u8) -> u64 {
    let start = mcu.cycle() + 1000;
    mcu.receive(PORT, Character { value, start, end: start + FRAME });
    mcu.run_until(start + 3 * FRAME);
    start
}

#[test]
fn every_byte_passes_in_both_directions() {
    let mut mcu = with_pins(&[]);
    assert!(mcu.pin(PINS.receive), "an idle line is high");
    for value in 0..=u8::MAX {
        let start = receive(&mut mcu, value);
        let [sent] = mcu.take_sent(PORT)[..] else { panic!("one byte is sent back") };
        assert_eq!(sent.value, value.wrapping_add(1));
        // Nine bits and a half are received before the answer.
        let begun = sent.start - start;
        assert!((9 * FRAME / 10..11 * FRAME / 10).contains(&begun), "{begun}");
        assert_eq!(sent.end - sent.start, FRAME);
    }
    assert_eq!(marked(&mcu), (0..=u8::MAX).collect::<Vec<u8>>());
    let counts = mcu.serial_pin_counts(0);
    assert_eq!(counts, Some(SerialPinCounts { sent: 256, received: 256, framing_errors: 0 }));
}

#[test]
fn a_character_without_a_stop_bit_is_none() {
    let mut mcu = with_pins(&["WITHOUT_STOP"]);
    receive(&mut mcu, 0x42);
    assert!(mcu.take_sent(PORT).is_empty());
    let counts = mcu.serial_pin_counts(0);
    assert_eq!(counts, Some(SerialPinCounts { sent: 0, received: 1, framing_errors: 1 }));
}

#[test]
fn the_line_is_idle_and_works_after_a_reset_in_mid_character() {
    let mut mcu = with_pins(&[]);
    for (value, reset_at) in (1..).zip([FRAME / 3, FRAME, 3 * FRAME / 2]) {
        let start = mcu.cycle() + 1000;
        mcu.receive(PORT, Character { value, start, end: start + FRAME });
        mcu.run_until(start + reset_at);
        mcu.reset(Reset::External);
        mcu.run_until(start + 4 * FRAME);
        mcu.take_sent(PORT);
        receive(&mut mcu, value);
        let values: Vec<u8> = mcu.take_sent(PORT).iter().map(|sent| sent.value).collect();
        assert_eq!(values, [value + 1], "reset {reset_at} cycles after the start");
    }
}

/// INT7 of the ATmega128.
const INT7: u8 = 8;

/// The core was asleep until the interrupt from outside, so simavr's count of the run was stale.
#[test]
fn edges_come_in_time_into_a_handler_that_the_outside_began() {
    let mut mcu = with_pins(&[]);
    mcu.add_probe(PINS.receive);
    mcu.take_edges(0);
    let start = mcu.cycle() + 1000;
    mcu.receive(PORT, Character { value: 0, start, end: start + FRAME });
    mcu.run_until(start - 300);
    mcu.raise_interrupt(INT7);
    mcu.run_until(start + FRAME);
    let edges: Vec<u64> = mcu.take_edges(0).iter().map(|edge| edge.cycle).collect();
    let [falls, rises] = edges[..] else { panic!("{edges:?}") };
    // No instruction of the handler takes more than 4 cycles.
    assert!((start..start + 4).contains(&falls), "{} late", falls - start);
    let stop = start + 9 * FRAME / 10;
    assert!((stop..stop + 4).contains(&rises), "{} late", rises - stop);
}
