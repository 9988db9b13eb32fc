//! Sizes, from the images as they are linked.
//!
//! The kernel's flash is what an image with every call of it once takes more than one without a kernel. Calls are compiled
//! into their callers, so no other line between kernel and program is sharp; what a caller does to make a call and to
//! look at its result counts as the kernel's. Of all six categories of AvrX's calls it has the EEPROM and single steps, too, with what
//! `board` does for them.

use super::{BenchError, Measured, TestImages, unmeasurable};

/// Variable of `bench_bytes`, bytes in it that are its user's, figure.
const VARIABLES: [(&str, u64, &str); 4] = [
    ("TASK_WITH_100_BYTES", 100, "task_bytes"),
    ("SEMAPHORE", 0, "semaphore_bytes"),
    ("TIMER", 0, "timer_bytes"),
    ("MESSAGE_OF_16_BYTES", 16, "message_bytes"),
];

pub(super) fn measure(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    const IMAGE: &str = "bench_bytes";
    let image = images.image(IMAGE)?;
    let mut measured = Vec::new();
    for (variable, payload, name) in VARIABLES {
        let size = image.symbol(variable).map(|symbol| u64::from(symbol.size));
        let overhead = size.and_then(|size| size.checked_sub(payload));
        let overhead = overhead.ok_or_else(|| {
            unmeasurable(IMAGE, format!("it has no {variable} of at least {payload} bytes"))
        })?;
        measured.push(Measured::bytes(name, overhead));
    }
    measured.push(Measured::bytes("kernel_flash_bytes", flash(images, "bench_flash")?));
    measured.push(Measured::bytes("kernel_flash_bytes_all", flash(images, "bench_flash_all")?));
    Ok(measured)
}

/// How much more of the flash, initial values included, the image takes than one without a kernel.
fn flash(images: &TestImages, name: &str) -> Result<u64, BenchError> {
    let [with, without] =
        [images.image(name)?, images.image("bench_flash_empty")?].map(|image| image.flash().len());
    let difference = with.checked_sub(without).map(|bytes| bytes as u64);
    difference.ok_or_else(|| unmeasurable(name, "it is smaller than the image without a kernel"))
}
