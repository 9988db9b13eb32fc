//! Edges at any times: the next character after a pause is understood.
#![no_main]

use board::soft_uart::BIT;
use board::soft_uart::decoder::{Character, EdgeDecoder};
use board::soft_uart::encoder::{Pulse, PulseEncoder};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let [byte, noise @ ..] = input else { return };
    let decoder = EdgeDecoder::new();
    let mut time = 0u16;
    for edge in noise.chunks_exact(2) {
        let [low, high] = edge else { continue };
        time = time.wrapping_add(u16::from_le_bytes([*low, high & 0x3f]));
        match high >> 6 {
            0 => _ = decoder.fall(time),
            1 => decoder.rise(time),
            2 if low & 1 != 0 => decoder.rise(decoder.untimed_rise()),
            2 => _ = decoder.fall(decoder.untimed_fall()),
            _ => _ = decoder.ended(low & 1 != 0),
        }
    }
    // The line is high, and a character in progress has been ended.
    decoder.rise(time);
    decoder.ended(true);
    let encoder = PulseEncoder::<BIT>::new();
    encoder.begin(*byte);
    while let Some(Pulse { low, length, .. }) = encoder.next(|| None) {
        decoder.fall(time);
        decoder.rise(time.wrapping_add(low));
        time = time.wrapping_add(length);
    }
    assert_eq!(decoder.ended(true), Some(Character::Byte(*byte)));
});
