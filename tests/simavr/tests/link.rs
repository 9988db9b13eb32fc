//! How much a link carries: two MCUs with the robot's own tasks, and a wire with wrong bits between them.

use simavr_harness::{CLOCK_HZ, Character, Mcu};
use superbot_tests_simavr::{MILLISECOND, mcu_with_seed};
use tasks::link::cobs::MAX_WIRE;

/// Cycles of a byte at 38400 baud, as the divisor makes them, and its bits.
const BYTE: u64 = 4160;
const BITS: u64 = 10;

/// Bytes on the wire of a message of 16 bytes, and of its ACK.
const FRAME: u64 = MAX_WIRE as u64;
const ACK: u64 = 6;

/// SplitMix64 (Steele, Lea, Flood, 2014).
struct Random(u64);

impl Random {
    fn chance(&mut self, probability: f64) -> bool {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ mixed >> 31) >> 11) as f64 / ((1_u64 << 53) as f64) < probability
    }
}

/// What arrives of a character when each bit is wrong with this probability. Without its start bit, or its stop bit,
/// it is none.
fn carry(character: Character, bit_errors: f64, random: &mut Random) -> Option<Character> {
    let [start, stop] = [(); 2].map(|()| random.chance(bit_errors));
    let wrong = (0..8).fold(0, |wrong, bit| wrong | u8::from(random.chance(bit_errors)) << bit);
    (!start && !stop).then_some(Character { value: character.value ^ wrong, ..character })
}

fn symbol(mcu: &Mcu, name: &str) -> u16 {
    let bytes = mcu.read_symbol(name).expect("the image has it");
    u16::from_le_bytes([bytes[0], bytes[1]])
}

/// Messages that a link carries in so many cycles.
fn messages(bit_errors: f64, cycles: u64) -> u16 {
    let mut ends = [mcu_with_seed("bench_link_a", 1), mcu_with_seed("bench_link_b", 2)];
    let mut random = Random(1);
    let warm_up = 200 * MILLISECOND;
    let mut before = 0;
    for window in 1..(warm_up + cycles) / BYTE {
        for end in &mut ends {
            end.run_until(window * BYTE);
        }
        for (from, to) in [(0, 1), (1, 0)] {
            for character in ends[from].take_sent(0) {
                if let Some(character) = carry(character, bit_errors, &mut random) {
                    ends[to].receive(0, character);
                }
            }
        }
        if window == warm_up / BYTE {
            before = symbol(&ends[1], "IN_TURN");
        }
    }
    symbol(&ends[1], "IN_TURN") - before
}

/// Throughput over that of stop-and-wait with no time between a frame and its ACK, in which a lost frame or ACK costs no
/// more than they take.
fn efficiency(bit_errors: f64) -> f64 {
    let cycles = 60 * u64::from(CLOCK_HZ);
    let arrives = |bytes: u64| (1.0 - bit_errors).powi((bytes * BITS) as i32);
    let bound = arrives(FRAME) * arrives(ACK) * (cycles / BYTE) as f64 / (FRAME + ACK) as f64;
    let messages = messages(bit_errors, cycles);
    println!("{bit_errors:e}: {messages} messages in 60 s, {:.3} of the bound", f64::from(messages) / bound);
    f64::from(messages) / bound
}

#[test]
fn a_link_carries_nine_tenths_of_what_stop_and_wait_can() {
    for bit_errors in [0.0, 1e-4, 1e-3] {
        let efficiency = efficiency(bit_errors);
        assert!(efficiency >= 0.9, "{bit_errors:e}: {efficiency}");
    }
}
