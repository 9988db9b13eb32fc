extern crate std;

use super::*;
use crate::soft_uart::encoder::{Pulse, PulseEncoder};
use std::vec::Vec;

/// The edges of `bytes`, sent back to back from `start` on, with bits of `bit` ticks.
fn edges<const SENT: u16>(start: u64, bytes: &[u8]) -> Vec<(u64, bool)> {
    let mut rest = bytes.iter().copied();
    let encoder = PulseEncoder::<SENT>::new();
    encoder.begin(rest.next().expect("there is a first byte"));
    let (mut time, mut edges) = (start, Vec::new());
    while let Some(Pulse { low, length, .. }) = encoder.next(|| rest.next()) {
        edges.extend([(time, false), (time + u64::from(low), true)]);
        time += u64::from(length);
    }
    edges
}

fn edge(decoder: &EdgeDecoder, time: u16, is_high: bool) -> Option<Event> {
    if is_high {
        decoder.rise(time);
        return None;
    }
    decoder.fall(time)
}

/// The result of a decoder for `edges`, if it is polled `late` ticks after the time that is set for the end
/// of a character.
fn decode(edges: &[(u64, bool)], late: u64) -> Vec<Character> {
    let decoder = EdgeDecoder::new();
    let (mut end, mut characters) = (None, Vec::new());
    let mut level = true;
    for (time, is_high) in edges.iter().copied().chain([(1 << 60, true)]) {
        if end.take_if(|end| *end + late < time).is_some() {
            characters.extend(decoder.ended(level));
        }
        level = is_high;
        let event = edge(&decoder, time as u16, is_high);
        characters.extend(event.and_then(|event| event.ended));
        if event.is_some() {
            assert!(!is_high);
            end = Some(time + u64::from(EdgeDecoder::END));
            assert_eq!(decoder.ends_at(), (time + u64::from(EdgeDecoder::END)) as u16);
        }
    }
    characters
}

fn bytes(bytes: &[u8]) -> Vec<Character> {
    bytes.iter().copied().map(Character::Byte).collect()
}

#[test]
fn every_pair_of_bytes_is_understood_at_any_time() {
    for first in 0..=255 {
        for second in 0..=255 {
            let sent = [first, second];
            let start = u64::from(first) * 256 + u64::from(second);
            assert_eq!(decode(&edges::<BIT>(start, &sent), 0), bytes(&sent), "{sent:?}");
        }
    }
}

#[test]
fn a_sender_may_be_off_by_five_percent() {
    for byte in 0..=255 {
        let sent = [byte, !byte, byte];
        assert_eq!(decode(&edges::<397>(7, &sent), 0), bytes(&sent), "5 % fast");
        assert_eq!(decode(&edges::<437>(7, &sent), 0), bytes(&sent), "5 % slow");
    }
}

#[test]
fn nothing_is_lost_if_the_end_is_looked_at_when_the_next_character_has_begun() {
    let sent: Vec<u8> = (0..=255).collect();
    for late in [0, 200, 300, 1_000, 60_000] {
        assert_eq!(decode(&edges::<BIT>(1, &sent), late), bytes(&sent), "{late} ticks late");
    }
}

#[test]
fn a_line_held_low_is_one_malformed_character() {
    let edges = [(10, false), (100_000, true)];
    assert_eq!(decode(&edges, 0), [Character::Malformed]);
    let mut after = Vec::from(edges);
    after.extend(self::edges::<BIT>(110_000, &[0x55]));
    assert_eq!(decode(&after, 0), [Character::Malformed, Character::Byte(0x55)]);
}

#[test]
fn a_pulse_shorter_than_half_a_bit_is_no_start_bit() {
    let mut with_pulse = Vec::from([(10, false), (10 + 200, true)]);
    with_pulse.extend(edges::<BIT>(500, &[0xa5]));
    assert_eq!(decode(&with_pulse, 0), bytes(&[0xa5]));
}

#[test]
fn a_glitch_that_is_over_when_it_is_looked_at_is_nothing() {
    let decoder = EdgeDecoder::new();
    decoder.rise(10);
    assert!(!decoder.is_busy());
    assert_eq!(decoder.ended(true), None);
}

#[test]
fn whatever_edges_come_the_next_character_after_a_pause_is_understood() {
    let mut noise = 12_345u32;
    let mut random = move |below: u32| {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (noise >> 8) % below
    };
    let decoder = EdgeDecoder::new();
    let mut time = 0;
    for _ in 0..20_000 {
        for _ in 0..random(9) {
            time += u64::from(random(2_000)) + 1;
            edge(&decoder, time as u16, random(2) != 0);
        }
        // The line is high for the time of a character, and the end of the one on it was polled.
        decoder.rise(time as u16);
        decoder.ended(true);
        time += u64::from(EdgeDecoder::END) + u64::from(random(100_000));
        let byte = random(256) as u8;
        for (at, is_high) in edges::<BIT>(time, &[byte]) {
            edge(&decoder, at as u16, is_high);
            time = at;
        }
        assert_eq!(decoder.ended(true), Some(Character::Byte(byte)));
        assert!(!decoder.is_busy());
    }
}

#[test]
fn an_edge_that_was_missed_came_a_bit_after_the_one_before() {
    for byte in 0..=255 {
        let sent = edges::<BIT>(0, &[byte]);
        let decoder = EdgeDecoder::new();
        let mut timed = sent.iter().copied().peekable();
        while let Some((time, is_high)) = timed.next() {
            let event = edge(&decoder, time as u16, is_high);
            assert_eq!(event.is_some(), time == 0);
            if let Some((_, is_high)) = timed.next_if(|(next, _)| next - time == u64::from(BIT)) {
                let time = if is_high { decoder.untimed_rise() } else { decoder.untimed_fall() };
                assert_eq!(edge(&decoder, time, is_high), None);
            }
        }
        assert_eq!(decoder.ended(true), Some(Character::Byte(byte)));
    }
}
