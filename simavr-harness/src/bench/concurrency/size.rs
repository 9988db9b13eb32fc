//! The size of the two programs, in the MCU and in lines of source.

use serde::Serialize;

use super::Style;
use crate::bench::flash::crate_of;
use crate::image::{Image, Place};

/// Bytes and lines.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Size {
    /// The whole image.
    pub flash_bytes: usize,
    /// The part of the flash that functions of the kernel take.
    pub flash_of_kernel_bytes: usize,
    /// Variables and the stacks of tasks. Handlers need the same of the remaining RAM in both programs.
    pub ram_bytes: usize,
    /// The part of the RAM that the stacks of tasks take.
    pub stack_bytes: usize,
    /// Lines of the sources that only this program has: its wiring, and the code that runs the state
    /// machines. Lines that are empty or comment do not count.
    pub lines: usize,
    /// Lines of the additions of the bench.
    pub trial_lines: usize,
}

/// The address of the first byte of RAM.
const RAM: u16 = 0x100;

impl Size {
    /// The size of the master's `image`.
    pub fn of(image: &Image, style: Style) -> Size {
        let sum = |is_meant: fn(&str, bool) -> bool| -> usize {
            named(image).filter(|(name, _, is_code)| is_meant(name, *is_code)).map(|(_, size, _)| size).sum()
        };
        let end = match image.symbol("__heap_start").map(|symbol| symbol.place) {
            Some(Place::Data(end)) => end,
            _ => RAM,
        };
        Size {
            flash_bytes: image.flash().len(),
            flash_of_kernel_bytes: sum(|name, is_code| is_code && is_of_kernel(name)),
            ram_bytes: usize::from(end - RAM),
            stack_bytes: sum(|name, is_code| !is_code && name.contains("::stack::")),
            lines: of_style(style).into_iter().map(lines).sum(),
            trial_lines: lines(trial(style)),
        }
    }
}

/// Whether the kernel defines the function of this name, its assembly included.
fn is_of_kernel(name: &str) -> bool {
    name.starts_with("kernel_") || crate_of(name) == Some("kernel")
}

/// The symbols of an image: name, bytes, and whether it is code.
fn named(image: &Image) -> impl Iterator<Item = (String, usize, bool)> {
    image.symbols().filter_map(|(name, symbol)| {
        let is_code = match symbol.place {
            Place::Flash(_) => true,
            Place::Data(_) => false,
            Place::Eeprom(_) => return None,
        };
        Some((format!("{:#}", rustc_demangle::demangle(name)), symbol.size.into(), is_code))
    })
}

/// The sources that only this program has.
fn of_style(style: Style) -> Vec<&'static str> {
    match style {
        Style::Tasks => vec![
            include_str!("../../../../firmware-master/src/main.rs"),
            include_str!("../../../../hormone/src/task/ac_receive.rs"),
            include_str!("../../../../hormone/src/task/ac_send.rs"),
            include_str!("../../../../hormone/src/task/hormone.rs"),
            run_of(include_str!("../../../../tasks/src/link/send.rs")),
            run_of(include_str!("../../../../tasks/src/link/receive.rs")),
            run_of(include_str!("../../../../tasks/src/bridge/task.rs")),
            run_of(include_str!("../../../../tasks/src/devices/task.rs")),
            run_of(include_str!("../../../../tasks/src/motor/task.rs")),
        ],
        Style::Loop => vec![
            include_str!("../../../../tests/sequential/src/main.rs"),
            include_str!("../../../../tests/sequential/src/behaviours.rs"),
            include_str!("../../../../tests/sequential/src/devices.rs"),
            include_str!("../../../../tests/sequential/src/due.rs"),
            include_str!("../../../../tests/sequential/src/joints.rs"),
            include_str!("../../../../tests/sequential/src/sending.rs"),
        ],
    }
}

fn trial(style: Style) -> &'static str {
    match style {
        Style::Tasks => include_str!("../../../../firmware-master/src/trial.rs"),
        Style::Loop => include_str!("../../../../tests/sequential/src/trial.rs"),
    }
}

/// The body of a task, which only the program with the kernel has.
fn run_of(source: &str) -> &str {
    function(source, "pub fn run")
}

/// The function that begins with `begin`, up to the closing brace at the start of a line.
fn function<'s>(source: &'s str, begin: &str) -> &'s str {
    let Some(start) = source.find(&format!("\n{begin}")) else { return "" };
    let rest = &source[start..];
    &rest[..rest.find("\n}\n").map_or(rest.len(), |end| end + 3)]
}

/// Lines that are neither empty nor comment.
fn lines(source: &str) -> usize {
    source.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_code_are_counted_and_each_source_has_some() {
        assert_eq!(lines("//! What\n\nfn one() {\n    // why\n    two();\n}\n"), 3);
        assert_eq!(
            function("fn a() {\n}\n\npub fn run() {\n    b();\n}\n\nfn c() {}\n", "pub fn run"),
            "\npub fn run() {\n    b();\n}\n"
        );
        for style in Style::ALL {
            assert!(
                of_style(style).into_iter().chain([trial(style)]).all(|source| lines(source) > 5),
                "{style:?}"
            );
        }
    }
}
