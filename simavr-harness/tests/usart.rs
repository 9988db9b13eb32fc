//! Tests the duration of a USART's frames, and the size of its buffers, against the datasheet.

use crate::common::{build_with, marked, mcu, mcu_of};
use simavr_harness::{Character, Part, State};

/// 8N1 at 38400 baud: ten bits of 416 cycles.
const FRAME: u64 = 4160;

#[test]
fn sixty_four_bytes_take_sixty_four_frames_and_one_txc() {
    for part in Part::ALL {
        let mut mcu = mcu_of(part, "usart.c", &["SEND"]);
        mcu.run_until(70 * FRAME);
        let sent = mcu.take_sent(0);
        assert_eq!(sent.len(), 64);
        assert_eq!(sent[63].end - sent[0].start, 64 * FRAME);
        assert!(sent.windows(2).all(|pair| pair[0].end == pair[1].start));
        let values: Vec<u8> = sent.iter().map(|character| character.value).collect();
        assert_eq!(values, (1..=64).rev().collect::<Vec<u8>>());
        assert_eq!(marked(&mcu), [0x77]);
        assert!(mcu.markers()[0].cycle >= sent[63].end);
        assert!(mcu.take_sent(0).is_empty());
    }
}

#[test]
fn a_byte_is_received_at_the_end_of_its_frame() {
    for part in Part::ALL {
        let mut mcu = mcu_of(part, "usart.c", &["ECHO"]);
        let end = 3 * FRAME;
        mcu.run_until(FRAME);
        mcu.receive(0, Character { value: 0x42, start: end - FRAME, end });
        mcu.run_until(5 * FRAME);
        let handled = mcu.markers()[0].cycle;
        // The response from sleep, `jmp`, and the registers that the handler saves before its marker.
        assert!((end + 8 + 3..end + 40).contains(&handled), "{}", handled - end);
        let [echo] = mcu.take_sent(0)[..] else { panic!("one byte is sent back") };
        assert_eq!(echo.value, 0x42);
        assert!((handled..handled + 10).contains(&echo.start));
        assert_eq!(mcu.usart_frame_cycles(0), Some(FRAME));
        assert_eq!(mcu.usart_frame_cycles(1), None, "USART1 is off");
    }
}

const DOR: u8 = 0x08;

/// The status and the data of each byte that a late program reads, and the number of overruns. The first of
/// `bytes` begins `before` cycles before the program reads.
fn read_late(bytes: u8, before: u64) -> (Vec<(u8, u8)>, u64) {
    let image = build_with("usart.c", &["LATE"]);
    let mut idle = mcu(&image);
    assert_eq!(idle.run_to_end(100_000), State::Done);
    let begin = idle.cycle() - before;
    let mut mcu = mcu(&image);
    mcu.run_to_marker(1, 10_000).unwrap();
    for value in 1..=bytes {
        let start = begin + u64::from(value - 1) * FRAME;
        mcu.receive(0, Character { value, start, end: start + FRAME });
    }
    assert_eq!(mcu.run_to_end(100_000), State::Done);
    let counts = mcu.usart_counts(0).unwrap();
    assert_eq!(counts.received, bytes.into());
    let read = marked(&mcu)[1..].chunks(2).map(|pair| (pair[0] & DOR, pair[1])).collect();
    (read, counts.overrun)
}

/// Two bytes wait in the buffer and one in the shift register. Each further byte replaces the one in the
/// shift register.
#[test]
fn bytes_not_read_in_time_are_lost_and_the_loss_is_flagged() {
    assert_eq!(read_late(2, 6 * FRAME), (vec![(0, 1), (0, 2)], 0));
    assert_eq!(read_late(3, 6 * FRAME), (vec![(0, 1), (0, 2), (0, 3)], 0));
    assert_eq!(read_late(5, 6 * FRAME), (vec![(DOR, 1), (0, 2), (0, 5)], 2));
}

/// A byte is lost when the start bit of another one comes, not at the end of that one.
#[test]
fn a_read_after_the_start_bit_of_a_byte_too_many_comes_too_late() {
    assert_eq!(read_late(4, 3 * FRAME + FRAME / 2), (vec![(0, 1), (DOR, 2), (0, 4)], 1));
    let in_time = (vec![(0, 1), (0, 2), (0, 3), (0, 4)], 0);
    assert_eq!(read_late(4, 3 * FRAME - FRAME / 2), in_time);
}

#[test]
fn a_receiver_that_is_off_hears_nothing() {
    let mut mcu = mcu(&build_with("usart.c", &["SEND"]));
    mcu.run_until(1000);
    mcu.receive(0, Character { value: 1, start: 1000, end: 1000 + FRAME });
    mcu.run_until(2 * FRAME);
    let counts = mcu.usart_counts(0).unwrap();
    assert_eq!((counts.received, counts.unheard), (0, 1));
}

/// It is switched on within the frame, and takes the next one.
#[test]
fn a_receiver_that_is_switched_on_within_a_frame_does_not_hear_it() {
    let mut mcu = mcu(&build_with("usart.c", &["KERNEL"]));
    let on = mcu.run_to_marker(1, 10_000).unwrap().cycle;
    for (value, start) in [(0x61, on - 20), (0x62, on - 20 + FRAME)] {
        mcu.receive(0, Character { value, start, end: start + FRAME });
    }
    mcu.run_until(on + 100_000);
    assert_eq!(marked(&mcu), [1, 0x62]);
    let counts = mcu.usart_counts(0).unwrap();
    assert_eq!((counts.received, counts.unheard), (1, 1));
}

/// What a receiver at 38400 baud makes of these characters, by their value, delay and length: a byte, and
/// whether its stop bit is missing.
fn received(characters: &[(u8, u64, u64)]) -> (u8, bool) {
    const FE: u8 = 0x10;
    let mut mcu = mcu(&build_with("usart.c", &["LATE"]));
    let at = mcu.run_to_marker(1, 10_000).unwrap().cycle;
    for &(value, delay, length) in characters {
        mcu.receive(0, Character { value, start: at + delay, end: at + delay + length });
    }
    assert_eq!(mcu.run_to_end(100_000), State::Done);
    let [status, byte] = marked(&mcu)[1..] else { panic!("one byte is read") };
    (byte, status & FE != 0)
}

/// It reads the line in the middle of each of its own bits.
#[test]
fn a_byte_at_another_rate_is_received_as_the_line_has_it() {
    let received = |value, length| received(&[(value, 0, length)]);
    assert_eq!(received(0x5a, FRAME), (0x5a, false));
    assert_eq!(received(0x5a, FRAME * 104 / 100), (0x5a, false), "4 % is within what a receiver takes");
    // At half the rate each bit is read twice, the start bit first, and bit 3 as the stop bit.
    assert_eq!(received(0x5a, 2 * FRAME), (0b1001_1000, false));
    assert_eq!(received(0x00, 2 * FRAME), (0, true));
    // At twice the rate bits 2, 4 and 6 are read, and then the idle line.
    assert_eq!(received(0x5a, FRAME / 2), (0b1111_1110, false));
}

/// The line is low while either byte is.
#[test]
fn of_bytes_that_overlap_the_zeros_are_received() {
    const BIT: u64 = FRAME / 10;
    let received = |value, delay| received(&[(0xfb, 0, FRAME), (value, delay, FRAME)]);
    assert_eq!(received(0xdf, 0), (0xdb, false));
    assert_eq!(received(0xff, 8 * BIT), (0x7b, false), "its start bit is the last bit of the first");
    assert_eq!(received(0xff, 9 * BIT), (0xfb, true), "its start bit is where the first one stops");
}

/// RXC is level-triggered: it raises the interrupt again although the handler did not end with RETI.
#[test]
fn bytes_that_wait_raise_one_interrupt_after_another() {
    let mut mcu = mcu(&build_with("usart.c", &["KERNEL"]));
    let start = mcu.run_to_marker(1, 10_000).unwrap().cycle;
    for (value, start) in [0x61, 0x62, 0x63].into_iter().zip((start..).step_by(FRAME as usize)) {
        mcu.receive(0, Character { value, start, end: start + FRAME });
    }
    mcu.run_until(start + 100_000);
    assert_eq!(marked(&mcu), [1, 0x61, 0x62, 0x63]);
}

#[test]
fn a_byte_left_in_the_buffer_raises_the_interrupt_again() {
    let mut mcu = mcu(&build_with("usart.c", &["IGNORE"]));
    mcu.run_until(FRAME);
    mcu.receive(0, Character { value: 0x42, start: FRAME, end: 2 * FRAME });
    mcu.run_until(4 * FRAME);
    assert_eq!(marked(&mcu), [0x22, 0x22, 0x22]);
}

#[test]
fn the_length_of_a_frame_follows_its_format() {
    const UBRRL: u16 = 0x29;
    const UCSRB: u16 = 0x2a;
    const UCSRA: u16 = 0x2b;
    const UCSRC: u16 = 0x95;
    let mut mcu = mcu(&build_with("usart.c", &["SEND"]));
    mcu.run_until(1000);
    // A bit takes 8 * (UBRR + 1) cycles.
    mcu.write(UBRRL, 9);
    for (format, bits) in [(0x06, 10), (0x00, 7), (0x0e, 11), (0x26, 11), (0x3e, 12)] {
        mcu.write(UCSRC, format);
        assert_eq!(mcu.usart_frame_cycles(0), Some(bits * 80), "UCSRC {format:#x}");
    }
    mcu.write(UCSRC, 0x06);
    mcu.write(UCSRB, 0x0c);
    assert_eq!(mcu.usart_frame_cycles(0), Some(11 * 80), "nine data bits");
    mcu.write(UCSRA, 0);
    assert_eq!(mcu.usart_frame_cycles(0), Some(11 * 160), "single speed");
}

/// A frame has no more bits of a byte than its format says (section "Frame Formats").
#[test]
fn a_frame_of_seven_bits_carries_seven() {
    const UCSRC: u16 = 0x95;
    const SEVEN_BITS: u8 = 0x04;
    let mut mcu = mcu(&build_with("usart.c", &["ECHO"]));
    mcu.run_until(FRAME);
    mcu.write(UCSRC, SEVEN_BITS);
    let end = 3 * FRAME;
    mcu.receive(0, Character { value: 0xc2, start: end - FRAME * 9 / 10, end });
    mcu.run_until(5 * FRAME);
    let [echo] = mcu.take_sent(0)[..] else { panic!("one byte is sent back") };
    assert_eq!((echo.value, echo.end - echo.start), (0x42, FRAME * 9 / 10));
}
