//! The longest time with interrupts off, over the whole run of every test image.

use super::{BenchError, Measured, TestImages};
use crate::image::Image;
use crate::masked::OpenedBy;

/// So long runs an image that does not end, in cycles: 0.25 s.
const RUN: u64 = 4_000_000;

pub(super) fn measure(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    let mut by_instruction = Measured::new("masked_cycles_kernel", 0);
    let mut by_interrupt = Measured::new("masked_cycles_isr", 0);
    for name in images.names()? {
        let mut mcu = images.mcu(&name)?;
        for window in mcu.masked_windows(RUN) {
            let longest = match window.opened_by {
                OpenedBy::Start => continue, // what a program does before its first task runs
                OpenedBy::Instruction => &mut by_instruction,
                OpenedBy::Interrupt(_) => &mut by_interrupt,
            };
            if window.cycles > longest.value {
                longest.value = window.cycles;
                longest.place = Some(format!("{} in {name}", place(mcu.image(), window.start)));
            }
        }
    }
    Ok(vec![by_instruction, by_interrupt])
}

/// The function at `address`, and how far into it that is.
fn place(image: &Image, address: u32) -> String {
    match image.function_at(address) {
        Some((function, distance)) => format!("{:#}+{distance:#x}", rustc_demangle::demangle(function)),
        None => format!("{address:#x}"),
    }
}
