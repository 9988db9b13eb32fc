//! Lists what a figure counts: cycles instruction by instruction, flash function by function.

use std::collections::HashMap;
use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use rustc_demangle::demangle;
use simavr_harness::bench::{self, Counted, Flash, Measured, Stretch};
use simavr_harness::{Image, MaskedWindow, OpenedBy};

use super::output;

/// Prints what the figure counts.
pub fn print(images: &Path, measured: &Measured) -> Result<(), Box<dyn Error>> {
    match &measured.counted {
        Counted::Cycles(stretch) => print_cycles(images, measured, stretch),
        Counted::Flash(flash) => print_flash(measured, flash),
        Counted::Number => Err(format!("{} counts neither cycles nor flash", measured.name).into()),
    }
}

/// Prints each instruction with its cycles and their sum so far.
fn print_cycles(images: &Path, measured: &Measured, stretch: &Stretch) -> Result<(), Box<dyn Error>> {
    let path = path(images, &stretch.image);
    let image = Image::load(&path)?;
    let instructions = disassemble(&path)?;
    let mut out = String::new();
    writeln!(out, "{}: {} cycles, measured in {}", measured.name, measured.value, stretch.image)?;
    let mut last_function = None;
    for step in bench::listing(images, stretch)? {
        let sum = step.at + step.cycles;
        let Some(pc) = step.pc else {
            writeln!(out, "{:5}  {sum:5}         (response to an interrupt)", step.cycles)?;
            continue;
        };
        let function = image.function_at(pc).map(|(name, _)| name);
        if function != last_function {
            writeln!(out, "                     {:#}:", demangle(function.unwrap_or("?")))?;
            last_function = function;
        }
        let instruction = instructions.get(&pc).map_or("?", String::as_str);
        writeln!(out, "{:5}  {sum:5}  {pc:5x}  {instruction}", step.cycles)?;
    }
    output::print(out)
}

/// Prints the functions with their bytes, the kernel's before the program's, and the sum of each.
fn print_flash(measured: &Measured, flash: &Flash) -> Result<(), Box<dyn Error>> {
    let mut out = String::new();
    writeln!(
        out,
        "{}: {} bytes more than without a kernel, measured in {}",
        measured.name, measured.value, flash.image
    )?;
    for (functions, sum, whose) in [
        (&flash.kernel, flash.of_kernel(), "the kernel's functions and initial values"),
        (&flash.program, flash.of_program(), "the program's functions, with the calls compiled into them"),
    ] {
        writeln!(out, "\n{sum:5}  {whose}:")?;
        for function in functions {
            writeln!(out, "{:5}  {}", function.bytes, function.name)?;
        }
    }
    output::print(out)
}

/// Prints the masked windows, longest first: cycles, number of times, and the place and cause of each.
pub fn print_windows(images: &Path) -> Result<(), Box<dyn Error>> {
    let mut out = String::new();
    for (name, window) in bench::windows(images)? {
        let MaskedWindow { start, opened_by, cycles, times, .. } = window;
        let place = match opened_by {
            OpenedBy::Interrupt(vector) => format!("interrupt {vector}"),
            _ => function(&Image::load(path(images, &name))?, start),
        };
        writeln!(out, "{cycles:5} cycles  {times:6} times  {place} in {name}")?;
    }
    output::print(out)
}

/// The place where the stretch of a figure begins.
pub fn place(images: &Path, stretch: &Stretch) -> Result<String, Box<dyn Error>> {
    let image = Image::load(path(images, &stretch.image))?;
    let steps = bench::listing(images, stretch)?;
    let place = match steps.iter().map(|step| step.pc).collect::<Vec<_>>()[..] {
        [Some(pc), ..] => function(&image, pc),
        [None, Some(pc), ..] => format!("interrupt {}", pc / VECTOR_BYTES),
        _ => "?".into(),
    };
    Ok(format!("{place} in {}", stretch.image))
}

/// Bytes of an entry in the table of vectors, which begins at 0 (ATmega128 datasheet, "Interrupt Vectors").
const VECTOR_BYTES: u32 = 4;

fn path(images: &Path, image: &str) -> PathBuf {
    images.join(image).with_extension("elf")
}

/// The function at `pc`, and the distance of `pc` from its begin.
fn function(image: &Image, pc: u32) -> String {
    match image.function_at(pc) {
        Some((name, distance)) => format!("{:#}+{distance:#x}", demangle(name)),
        None => format!("{pc:#x}"),
    }
}

/// The image's instructions by their address.
fn disassemble(path: &Path) -> Result<HashMap<u32, String>, Box<dyn Error>> {
    let output = Command::new("avr-objdump").args(["-d", "--no-show-raw-insn"]).arg(path).output();
    let output = output.map_err(|error| format!("can't run avr-objdump (package binutils-avr): {error}"))?;
    if !output.status.success() {
        return Err(format!("avr-objdump: {}", String::from_utf8_lossy(&output.stderr).trim()).into());
    }
    let lines = String::from_utf8(output.stdout)?;
    let instructions = lines.lines().filter_map(|line| {
        let (address, text) = line.split_once(":\t")?;
        let instruction = text.split(';').next().unwrap_or(text);
        Some((u32::from_str_radix(address.trim(), 16).ok()?, instruction.trim().replace('\t', " ")))
    });
    Ok(instructions.collect())
}
