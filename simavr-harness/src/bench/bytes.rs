//! Sizes, from the linked images.
//!
//! The kernel's flash is measured in two ways on a program that makes every call once: the kernel's own
//! functions, as other kernels' flash is measured; and these together with the calls that are compiled into
//! the program, and its use of their results. The program with all six categories of AvrX's calls also has
//! the EEPROM and single steps, with what `board` does for them.

use super::{BenchError, Counted, Flash, Measured, TestImages, unmeasurable};

/// Variable of `bench_bytes`, bytes in it that belong to the user, figure.
const VARIABLES: [(&str, u64, &str); 4] = [
    ("TASK_WITH_100_BYTES", 100, "task_bytes"),
    ("SEMAPHORE", 0, "semaphore_bytes"),
    ("TIMER", 0, "timer_bytes"),
    ("MESSAGE_OF_16_BYTES", 16, "message_bytes"),
];

/// Image, figure of the kernel's functions, figure with the program.
const PROGRAMS: [(&str, &str, &str); 2] = [
    ("bench_flash", "kernel_flash_bytes", "kernel_flash_bytes_with_calls"),
    ("bench_flash_all", "kernel_flash_bytes_all", "kernel_flash_bytes_all_with_calls"),
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
        measured.push(Measured::number(name, overhead));
    }
    for (image, own, with_calls) in PROGRAMS {
        let flash = Flash::of(images, image)?;
        let kernel = flash.of_kernel();
        for (name, bytes) in [(own, kernel), (with_calls, kernel + flash.of_program())] {
            let value = u64::try_from(bytes)
                .map_err(|_| unmeasurable(image, "it is smaller than the image without a kernel"))?;
            measured.push(Measured { name, value, counted: Counted::Flash(flash.clone()) });
        }
    }
    Ok(measured)
}
