//! The longest time with interrupts off, over the whole run of every test image of the kernel.

use std::path::Path;

use super::{BenchError, Measured, Stretch, TestImages, unmeasurable};
use crate::mcu::masked::{MaskedWindow, OpenedBy};

/// The run of an image that does not end, in cycles: 0.25 s.
const RUN: u64 = 4_000_000;

/// Prefixes of the names of images that are left out: those for drivers and the tasks above them, and single
/// steps, which hold up all interrupts for thousands of cycles, masked or not.
const OTHERS: [&str; 6] = ["board_", "bench_bridge_", "bench_link_", "devices", "flood_", "step"];

/// The images that make the usual calls: signals and messages to tasks that wait for nothing else.
const USUAL: [&str; 2] = ["bench_queue", "bench_tasks"];

pub(super) fn measure(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    // Drivers have handlers of their own, and their images tests of their own.
    let is_of_kernel = |name: &str| !OTHERS.iter().any(|other| name.starts_with(other));
    let mut windows = windows_of(images)?;
    windows.retain(|(name, _)| is_of_kernel(name));
    let longest = |name, is_counted: fn(&str, OpenedBy) -> bool| {
        let (image, window) = windows
            .iter()
            .find(|(image, window)| is_counted(image, window.opened_by))
            .ok_or_else(|| unmeasurable("all images", format!("no window for {name}")))?;
        let cycles = window.at..window.at + window.cycles;
        Ok::<_, BenchError>(Measured::cycles(name, Stretch::of(image, cycles)))
    };
    Ok(vec![
        longest("masked_cycles_kernel", |_, opened_by| opened_by == OpenedBy::Instruction)?,
        longest("masked_cycles_kernel_usual", |image, opened_by| {
            USUAL.contains(&image) && opened_by == OpenedBy::Instruction
        })?,
        longest("masked_cycles_isr", |_, opened_by| matches!(opened_by, OpenedBy::Interrupt(_)))?,
    ])
}

/// The masked windows of all test images in `directory`, longest first: one entry for each place and cause,
/// with its image. The window from the start until interrupts are first enabled is left out.
///
/// # Errors
/// The directory or an image can't be read.
pub fn windows(directory: &Path) -> Result<Vec<(String, MaskedWindow)>, BenchError> {
    windows_of(&TestImages { directory })
}

fn windows_of(images: &TestImages) -> Result<Vec<(String, MaskedWindow)>, BenchError> {
    let mut windows = Vec::new();
    for name in images.names()? {
        let of_image = images.mcu(&name)?.masked_windows(RUN);
        let of_tasks = of_image.into_iter().filter(|window| window.opened_by != OpenedBy::Start);
        windows.extend(of_tasks.map(|window| (name.clone(), window)));
    }
    windows.sort_by_key(|(_, window)| std::cmp::Reverse(window.cycles));
    Ok(windows)
}
