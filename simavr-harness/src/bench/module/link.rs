//! Measures the throughput of a link: two MCUs with the robot's own tasks, and a wire with bit errors between
//! them.

use std::path::Path;
use std::sync::Arc;

use simulation::Random;

use super::{BYTE, MILLISECOND, SECOND};
use crate::bench::{BenchError, unmeasurable};
use crate::character::Character;
use crate::image::Image;
use crate::mcu::Mcu;
use crate::part::Part;

const BITS: f64 = 10.0;

/// The link's throughput in a minute, with each bit wrong with the probability `bit_errors`, as a fraction of
/// a bound. The bound is stop-and-wait with no time between a frame and its ACK, in which a lost frame or ACK
/// costs only the time on the wire of both. The test images `bench_link_*` are in `directory`.
///
/// # Errors
/// An image is missing, or has no link.
pub fn link_efficiency(directory: &Path, bit_errors: f64) -> Result<f64, BenchError> {
    let cycles = 60 * SECOND;
    let Carried { messages, frame, ack } = carried(directory, bit_errors, cycles)?;
    let arrives = |bytes: f64| (1.0 - bit_errors).powf(bytes * BITS);
    let bound = arrives(frame) * arrives(ack) * (cycles / BYTE) as f64 / (frame + ack);
    Ok(f64::from(messages) / bound)
}

/// The load that a link carried.
struct Carried {
    messages: u16,
    /// The average bytes on the wire of a message of 16 bytes, and of an ACK: some take one more than others.
    frame: f64,
    ack: f64,
}

/// Runs a link for `cycles` cycles.
fn carried(directory: &Path, bit_errors: f64, cycles: u64) -> Result<Carried, BenchError> {
    let mcu = |name: &str, seed| {
        let image = Arc::new(Image::load(directory.join(name).with_extension("elf"))?);
        Ok::<_, BenchError>(Mcu::new(Part::ATMEGA128, image, seed)?)
    };
    let mut ends = [mcu("bench_link_a", 1)?, mcu("bench_link_b", 2)?];
    let mut random = Random::new(1);
    let warm_up = 200 * MILLISECOND;
    let mut before = 0;
    // For each end, the bytes and the frames that it sent.
    let mut sent = [(0, 0); 2];
    for window in 1..(warm_up + cycles) / BYTE {
        for end in &mut ends {
            end.run_until(window * BYTE);
        }
        for (from, to) in [(0, 1), (1, 0)] {
            for character in ends[from].take_sent(0) {
                sent[from].0 += 1;
                sent[from].1 += u32::from(character.value == 0);
                if let Some(character) = carry(character, bit_errors, &mut random) {
                    ends[to].receive(0, character);
                }
            }
        }
        if window == warm_up / BYTE {
            before = in_turn(&ends[1])?;
        }
    }
    let [frame, ack] = sent.map(|(bytes, frames)| f64::from(bytes) / f64::from(frames));
    Ok(Carried { messages: in_turn(&ends[1])?.wrapping_sub(before), frame, ack })
}

/// The character that arrives when each bit is wrong with the probability `bit_errors`; `None` if the start
/// bit or the stop bit is wrong.
fn carry(character: Character, bit_errors: f64, random: &mut Random) -> Option<Character> {
    let [start, stop] = [(); 2].map(|()| random.chance(bit_errors));
    let wrong = (0..8).fold(0, |wrong, bit| wrong | u8::from(random.chance(bit_errors)) << bit);
    (!start && !stop).then_some(Character { value: character.value ^ wrong, ..character })
}

/// The number of messages that have come in turn, as the test image on `mcu` counts them; the count wraps.
pub fn in_turn(mcu: &Mcu) -> Result<u16, BenchError> {
    word(mcu, "IN_TURN")
}

/// The word at the start of a variable.
pub fn word(mcu: &Mcu, name: &str) -> Result<u16, BenchError> {
    let bytes = mcu.read_symbol(name).ok();
    let word = bytes.and_then(|bytes| Some(u16::from_le_bytes(*bytes.first_chunk()?)));
    word.ok_or_else(|| unmeasurable("test image", format!("it has no {name}")))
}
