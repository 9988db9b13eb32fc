//! Measures stretches between two marks.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{BEFORE_OUT, BenchError, END, Measured, OUT, Stretch, TestImages, keep_longest, unmeasurable};
use crate::mcu::State;

/// Image, number of the stretch in it, figure.
const STRETCHES: [(&str, u8, &str); 10] = [
    ("bench_tasks", 1, "yield_cycles"),
    ("bench_tasks", 2, "post_to_higher_cycles"),
    ("bench_tasks", 3, "block_to_lower_cycles"),
    ("bench_tasks", 4, "post_cycles"),
    ("bench_tasks", 5, "wait_cycles"),
    ("bench_tasks", 6, "post_by_call_to_higher_cycles"),
    ("bench_preempted", 1, "block_to_preempted_cycles"),
    ("bench_queue", 1, "message_to_higher_cycles"),
    ("bench_queue", 2, "message_send_cycles"),
    ("bench_queue", 3, "message_receive_cycles"),
];

/// The cycles for which the images run, which repeat their stretches for ever.
const RUN: u64 = 100_000;

pub(super) fn measure(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    let mut longest = BTreeMap::new();
    for image in ["bench_tasks", "bench_preempted", "bench_queue"] {
        longest.insert(image, longest_stretches(images, image)?);
    }
    STRETCHES
        .into_iter()
        .map(|(image, number, name)| match longest.get(image).and_then(|stretches| stretches.get(&number)) {
            Some(Some(cycles)) => Ok(Measured::cycles(name, Stretch::of(image, cycles.clone()))),
            _ => Err(unmeasurable(image, format!("it has no stretch {number}, for {name}"))),
        })
        .collect()
}

/// The longest stretch of each number, from the last mark at its begin to the next mark at its end, without
/// the marks.
fn longest_stretches(
    images: &TestImages,
    image: &str,
) -> Result<BTreeMap<u8, Option<Range<u64>>>, BenchError> {
    let mut mcu = images.mcu(image)?;
    let state = mcu.run_to_end(RUN);
    if state != State::Running {
        let last = mcu.markers().last().map_or(0, |marker| marker.value);
        return Err(unmeasurable(
            image,
            format!("it should run on, but is {state:?}; its last mark is {last:#x}"),
        ));
    }
    let mut begun = BTreeMap::new();
    let mut longest = BTreeMap::new();
    for marker in mcu.markers() {
        let number = marker.value & !END;
        if marker.value & END == 0 {
            begun.insert(number, marker.cycle + OUT);
        } else if let Some(begin) = begun.remove(&number) {
            keep_longest(longest.entry(number).or_default(), begin..marker.cycle - BEFORE_OUT);
        }
    }
    Ok(longest)
}
