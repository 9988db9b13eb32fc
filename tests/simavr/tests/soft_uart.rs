//! The vectors of the UART in software, compared with the expected signal on the wire.

use simavr_harness::{Character, Mcu, Pin, Place, SerialPins};
use superbot_tests_simavr::soft_uart::{FRAME, LINE};
use superbot_tests_simavr::{MILLISECOND, mcu};

/// The most bytes of a frame, including its zero, that the inbox holds whenever the task is woken.
const LONGEST: usize = 31;

/// An MCU that sends back what it receives.
fn echo() -> Mcu {
    let mut mcu = mcu("board_soft_uart");
    mcu.add_serial_pins(SerialPins {
        receive: Pin { port: 'E', bit: 7 },
        transmit: Pin { port: 'E', bit: 5 },
    });
    mcu.run_until(10 * MILLISECOND); // until it listens
    mcu
}

/// Sends `frame` with bits that are `off` per mille too long, and returns what comes back.
fn exchange(mcu: &mut Mcu, frame: &[u8], off: i64) -> Vec<u8> {
    let length = FRAME.saturating_add_signed(FRAME as i64 * off / 1000);
    let mut start = mcu.cycle();
    for &value in frame {
        mcu.receive(LINE, Character { value, start, end: start + length });
        start += length;
    }
    let mut heard = Vec::new();
    // If the MCU finds a character coming in, it tries again at the next tick, four characters away at most.
    let end = mcu.cycle() + 2 * (frame.len() as u64 + 6) * length;
    while heard.last() != Some(&0) && mcu.cycle() < end {
        mcu.run_until(mcu.cycle() + FRAME);
        heard.extend(mcu.take_sent(LINE).into_iter().map(|character| character.value));
    }
    assert_eq!(mcu.markers(), [], "bytes were lost");
    mcu.run_until(mcu.cycle() + FRAME); // until it listens
    heard
}

/// A ring in which each pair of bytes other than zero occurs once.
fn pairs() -> Vec<u8> {
    let mut ring = Vec::new();
    for first in 1..=255 {
        ring.push(first);
        ring.extend((1..=255).filter(|&second| second > first).flat_map(|second| [first, second]));
    }
    ring
}

#[test]
fn every_pair_of_bytes_goes_both_ways() {
    let mut mcu = echo();
    let ring = pairs();
    let mut seen = vec![false; 1 << 16];
    // Neighbouring frames share a byte, and the last comes around.
    let around: Vec<u8> = ring.iter().chain(ring.first()).copied().collect();
    let mut place = 0;
    while place + 1 < around.len() {
        let end = around.len().min(place + LONGEST - 1);
        let frame = [&around[place..end], &[0]].concat();
        assert_eq!(exchange(&mut mcu, &frame, 0), frame);
        for pair in frame.windows(2) {
            seen[usize::from(pair[0]) << 8 | usize::from(pair[1])] = true;
        }
        place = end - 1;
    }
    for first in 1..=255 {
        assert!((1..=255).all(|second| seen[first << 8 | second]), "{first} and what follows");
    }
}

#[test]
fn a_sender_may_be_off_by_four_percent() {
    let mut mcu = echo();
    for off in [-40, 40] {
        for byte in 1..=255 {
            let frame = [byte, !byte | 1, byte, 0];
            assert_eq!(exchange(&mut mcu, &frame, off), frame, "by {off} per mille");
        }
    }
}

#[test]
fn interrupts_may_be_held_up_for_more_than_a_bit() {
    let mut mcu = echo();
    let Some(Place::Data(address)) = mcu.image().symbol("HOLDS_UP").map(|symbol| symbol.place) else {
        panic!("the image has it");
    };
    mcu.write(address, 1);
    mcu.run_until(mcu.cycle() + MILLISECOND);
    for byte in 1..=255 {
        let frame = [byte, 0x55, !byte | 1, 0xaa, byte, 0];
        assert_eq!(exchange(&mut mcu, &frame, 0), frame);
    }
}

#[test]
fn a_frame_that_is_cut_off_is_ended_when_the_next_begins() {
    let mut mcu = echo();
    let start = mcu.cycle();
    mcu.receive(LINE, Character { value: 7, start, end: start + FRAME });
    mcu.run_until(start + 5 * MILLISECOND);
    // The zero is put in as this frame begins.
    assert_eq!(exchange(&mut mcu, &[8, 9, 0], 0), [7, 0]);
    assert_eq!(exchange(&mut mcu, &[], 0), [8, 9, 0]);
}

/// This happens when two ends begin to send at once: each receives the rest of the other's frame.
#[test]
fn a_frame_that_is_cut_off_is_ended_too_where_the_next_comes_behind_one_that_is_sent() {
    let mut mcu = echo();
    let mut start = mcu.cycle();
    for value in [1, 2, 0, 7] {
        mcu.receive(LINE, Character { value, start, end: start + FRAME });
        start += FRAME;
    }
    mcu.run_until(start);
    assert_eq!(mcu.take_sent(LINE), [], "nothing is sent while 7 comes in");
    assert_eq!(exchange(&mut mcu, &[], 0), [1, 2, 0]);
    assert_eq!(exchange(&mut mcu, &[8, 9, 0], 0), [7, 0]);
    assert_eq!(exchange(&mut mcu, &[], 0), [8, 9, 0]);
}

/// The line can't receive while it sends, so answering the first frame at once would lose the second.
#[test]
fn nothing_is_sent_while_a_character_comes_in() {
    let mut mcu = echo();
    let frame = [1, 2, 3, 0];
    // The pauses range from none to one in which the answer has begun.
    for pause in (0..FRAME / 8).step_by(10) {
        let mut start = mcu.cycle();
        for (place, value) in [frame, frame].concat().into_iter().enumerate() {
            start += if place == frame.len() { pause } else { 0 };
            mcu.receive(LINE, Character { value, start, end: start + FRAME });
            start += FRAME;
        }
        mcu.run_until(start);
        let before = mcu.take_sent(LINE);
        assert!(before.is_empty(), "{pause} cycles after the first frame: {before:?}");
        mcu.run_until(start + 20 * FRAME);
        let heard: Vec<u8> = mcu.take_sent(LINE).into_iter().map(|character| character.value).collect();
        assert_eq!(heard, [frame, frame].concat(), "{pause} cycles after the first frame");
    }
}

#[test]
fn a_line_held_low_is_a_byte_that_is_lost() {
    let mut mcu = echo();
    mcu.drive_pin(Pin { port: 'E', bit: 7 }, false);
    mcu.run_until(mcu.cycle() + 10 * FRAME);
    mcu.drive_pin(Pin { port: 'E', bit: 7 }, true);
    mcu.run_until(mcu.cycle() + FRAME);
    let start = mcu.cycle();
    for (value, start) in [5, 0].into_iter().zip([start, start + FRAME]) {
        mcu.receive(LINE, Character { value, start, end: start + FRAME });
    }
    mcu.run_until(start + 20 * FRAME);
    let heard: Vec<u8> = mcu.take_sent(LINE).into_iter().map(|character| character.value).collect();
    assert_eq!(heard, [5, 0]);
    assert_eq!(mcu.markers().len(), 1, "the task has been told");
}

#[test]
fn a_frame_longer_than_any_is_lost_and_the_next_one_comes() {
    let mut mcu = echo();
    let mut start = mcu.cycle();
    let too_long = std::iter::repeat_n(0x55, 255).chain([0]);
    for value in too_long.chain([1, 2, 3, 0]) {
        mcu.receive(LINE, Character { value, start, end: start + FRAME });
        start += FRAME;
    }
    mcu.run_until(start + 10 * FRAME);
    let heard: Vec<u8> = mcu.take_sent(LINE).into_iter().map(|character| character.value).collect();
    assert_eq!(heard, [1, 2, 3, 0]);
    assert_eq!(mcu.markers().len(), 1, "the task has been told");
}
