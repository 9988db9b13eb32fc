//! A program as the linker leaves it: the content of flash, its symbols, and the tasks that it starts.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SymbolKind, elf};
use thiserror::Error;

use crate::vectors;

/// Where the linker puts the data space; flash begins at 0.
const DATA: u64 = 0x80_0000;

/// The section in which the kernel's `Stack::start` leaves a record for each task.
const TASKS: &str = ".debug_tasks";

/// The note in which the start-up code names the MCU: twelve words, of which the first is the length of the
/// owner's name, one of them, and then texts, of which the first is empty and the second the MCU's name.
const DEVICE: &str = ".note.gnu.avr.deviceinfo";
const DEVICE_TEXTS: usize = 12 * 4;

/// The start of the name of a task's entry function. The task's body follows, then its return type and `>`.
const ENTRY: &str = "kernel::arch::avr::start::enter::<";

/// The part of `e_flags` that names the architecture, and the architecture whose program counter has 3 bytes.
const ARCHITECTURE: u32 = 0x7f;
const AVR6: u32 = 6;

/// An AVR program read from an ELF file.
pub struct Image {
    pub(crate) flash: Vec<u8>,
    /// The name of the MCU, as `-mmcu` has it, if the start-up code tells it.
    mcu: Option<String>,
    /// The bytes that a call pushes.
    pub(crate) return_address: u16,
    pub(crate) tasks: BTreeSet<Task>,
    /// The address of the last byte of SRAM. `main` and all interrupt handlers run on the stack that begins
    /// there.
    pub(crate) stack: u16,
    /// The end of the variables, which lie below that stack.
    pub(crate) variables_end: u16,
    /// Functions and labels by address. Labels inside of functions do not count.
    symbols: Symbols,
    /// Labels inside of functions.
    labels: Symbols,
    /// The address ranges of variables in SRAM, by name. Several entries of one name are parts of one static.
    variables: Vec<(String, Range<u16>)>,
}

/// The record of a task: 4, 2 and 2 bytes, little-endian.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Task {
    /// The start of its code.
    pub entry: u32,
    /// The bytes that its closure captured. They lie at the top of its stack.
    pub captured: u16,
    /// The size of its stack, in bytes.
    pub stack: u16,
}

/// Why there is no image.
#[derive(Debug, Error)]
pub enum ImageError {
    #[error("cannot read {}: {source}; build the images with ./x build", .path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("not an ELF file ({0}); build the images with ./x build")]
    NotElf(#[from] object::Error),
    #[error("an ELF file for machine {0}, not for an AVR; build the images with ./x build")]
    NotAvr(u16),
    #[error("the image has no symbol {0}: link it with avr-gcc, and do not strip it")]
    NoSymbol(&'static str),
    #[error("section {TASKS} does not list the task that begins with {0}: do not strip the image")]
    NotListed(String),
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// The file cannot be read, is not an AVR program, or was stripped.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ImageError> {
        let path = path.as_ref();
        let bytes =
            std::fs::read(path).map_err(|source| ImageError::Unreadable { path: path.to_owned(), source })?;
        Self::parse(&bytes)
    }

    fn parse(bytes: &[u8]) -> Result<Self, ImageError> {
        let file = ElfFile32::<Endianness>::parse(bytes)?;
        let (header, endian) = (file.elf_header(), file.endian());
        if header.e_machine(endian) != elf::EM_AVR {
            return Err(ImageError::NotAvr(header.e_machine(endian)));
        }
        let mut flash = Vec::new();
        for segment in file.elf_program_headers() {
            let at = segment.p_paddr(endian);
            if segment.p_type(endian) == elf::PT_LOAD && u64::from(at) < DATA {
                place(&mut flash, at as usize, segment.data(endian, bytes).unwrap_or_default());
            }
        }
        let address = |name| {
            let symbol = file.symbol_by_name(name).ok_or(ImageError::NoSymbol(name))?;
            Ok::<_, ImageError>(symbol.address() as u16)
        };
        let records = file.section_by_name(TASKS).map_or(Ok(&[][..]), |section| section.data())?;
        let tasks: BTreeSet<_> = records.chunks_exact(8).map(task).collect();
        let (symbols, labels) = symbols(&file);
        let is_listed = |entry| tasks.iter().any(|task| task.entry == entry);
        if let Some((_, name)) = symbols.iter().find(|(at, name)| name.starts_with(ENTRY) && !is_listed(*at))
        {
            return Err(ImageError::NotListed(name.clone()));
        }
        let device = file.section_by_name(DEVICE).map_or(Ok(&[][..]), |section| section.data())?;
        Ok(Image {
            flash,
            mcu: mcu(device),
            return_address: if header.e_flags(endian) & ARCHITECTURE == AVR6 { 3 } else { 2 },
            tasks,
            stack: address("__stack")?,
            variables_end: address("_end")?,
            symbols,
            labels,
            variables: variables(&file),
        })
    }

    /// The address ranges of the variable of this name in SRAM: several if the compiler has split it, none if
    /// there is no such variable.
    pub fn variable(&self, name: &str) -> impl Iterator<Item = &Range<u16>> {
        self.variables.iter().filter(move |(other, _)| other == name).map(|(_, place)| place)
    }

    /// The name of the function at an address.
    pub fn name(&self, address: u32) -> &str {
        self.symbol(address).map_or("?", |(_, name)| name)
    }

    /// The start of the function at an address.
    pub(crate) fn start(&self, address: u32) -> u32 {
        self.symbol(address).map_or(0, |&(at, _)| at)
    }

    /// The last symbol up to an address.
    fn symbol(&self, address: u32) -> Option<&(u32, String)> {
        let after = self.symbols.partition_point(|&(at, _)| at <= address);
        self.symbols[..after].last()
    }

    /// The name of the body of the task whose code begins at `entry`.
    pub fn body(&self, entry: u32) -> &str {
        let name = self.name(entry);
        name.strip_prefix(ENTRY).map_or(name, first_argument)
    }

    /// The start of the function of this name. A `*` at the end of the name stands for the rest, if only one
    /// function fits. The rest of the name of a closure's function changes with the number of closures before
    /// it.
    pub fn function(&self, name: &str) -> Option<u32> {
        let Some(begin) = name.strip_suffix('*') else {
            return self.symbols.iter().find(|(_, other)| other == name).map(|&(at, _)| at);
        };
        let mut found = self.symbols.iter().filter(|(_, other)| other.starts_with(begin));
        let &(at, _) = found.next()?;
        found.all(|&(other, _)| other == at).then_some(at)
    }

    /// The starts of all functions of this name, since files may have functions of their own, or of the one
    /// that fits a name with a `*`.
    pub(crate) fn functions(&self, name: &str) -> BTreeSet<u32> {
        let exact = self.symbols.iter().filter(|(_, other)| other == name).map(|&(at, _)| at);
        exact.chain(self.function(name)).collect()
    }

    /// The whole name of a function whose name may end with a `*`, as [`function`](Self::function) has it.
    pub fn whole_name<'a>(&'a self, name: &'a str) -> Option<&'a str> {
        let at = self.function(name)?;
        Some(if name.ends_with('*') { self.name(at) } else { name })
    }

    /// The address of the label of this name, inside of a function.
    pub fn label(&self, name: &str) -> Option<u32> {
        self.labels.iter().find(|(_, other)| other == name).map(|&(at, _)| at)
    }

    /// The interrupts that the program serves: the number of each vector, and the address of its handler.
    pub fn interrupts(&self) -> impl Iterator<Item = (u8, u32)> {
        // All other vectors lead there.
        let other = self.function("__bad_interrupt");
        let number = |name: &str| name.strip_prefix("__vector_").and_then(|number| number.parse().ok());
        let served = self.symbols.iter().filter(move |(at, _)| Some(*at) != other);
        served.filter_map(move |(at, name)| Some((number(name)?, *at)))
    }

    /// The name of the MCU that the program was linked for, as `-mmcu` has it, if its start-up code tells it.
    pub fn mcu(&self) -> Option<&str> {
        self.mcu.as_deref()
    }

    /// The name of the interrupt with this vector in a program for the ATmega128; "?" for another MCU.
    pub fn interrupt_name(&self, vector: u8) -> &'static str {
        let is_known = matches!(self.mcu(), Some("atmega128" | "atmega128a"));
        vectors::name(vector).filter(|_| is_known).unwrap_or("?")
    }

    /// How many bytes a call and an interrupt push.
    pub fn return_address_bytes(&self) -> u16 {
        self.return_address
    }

    /// The start addresses of the program's tasks.
    pub fn task_entries(&self) -> impl Iterator<Item = u32> {
        self.tasks.iter().map(|task| task.entry)
    }

    /// The addresses of the handlers of the program's interrupt vectors.
    pub(crate) fn vectors(&self) -> impl Iterator<Item = u32> {
        self.symbols.iter().filter(|(_, name)| name.starts_with("__vector_")).map(|&(at, _)| at)
    }
}

/// Copies `content` to `at`; a gap before it becomes unprogrammed flash.
fn place(flash: &mut Vec<u8>, at: usize, content: &[u8]) {
    let end = at + content.len();
    if flash.len() < end {
        flash.resize(end, 0xff);
    }
    flash[at..end].copy_from_slice(content);
}

/// The first of generic arguments, which end in `, ` or `>`.
fn first_argument(arguments: &str) -> &str {
    let mut depth = 0;
    let mut before = ' ';
    let end = arguments.find(|character| {
        match character {
            '<' | '(' | '[' | '{' => depth += 1,
            '>' if before == '-' => {} // an arrow
            '>' | ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        before = character;
        depth < 0 || depth == 0 && character == ','
    });
    &arguments[..end.unwrap_or(arguments.len())]
}

/// The name of the MCU in the note about it.
fn mcu(device: &[u8]) -> Option<String> {
    let name = device.get(DEVICE_TEXTS..)?.split(|&byte| byte == 0).nth(1)?;
    String::from_utf8(name.to_vec()).ok().filter(|name| !name.is_empty())
}

fn task(record: &[u8]) -> Task {
    let number = |bytes: &[u8]| bytes.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte));
    Task {
        entry: number(&record[..4]),
        captured: number(&record[4..6]) as u16,
        stack: number(&record[6..]) as u16,
    }
}

/// Addresses in flash, and the names there.
type Symbols = Vec<(u32, String)>;

/// Functions and labels outside of them, by address; and the labels inside of them.
fn symbols(file: &ElfFile32<Endianness>) -> (Symbols, Symbols) {
    let in_flash = |symbol: &object::read::elf::ElfSymbol32<Endianness>| {
        symbol.section_index().is_some() && symbol.address() < DATA
    };
    let (functions, labels): (Vec<_>, Vec<_>) =
        file.symbols().filter(in_flash).partition(|symbol| symbol.kind() == SymbolKind::Text);
    let is_outside = |address: u64| {
        !functions
            .iter()
            .any(|function| (function.address()..function.address() + function.size()).contains(&address))
    };
    let (outside, inside): (Vec<_>, Vec<_>) =
        labels.into_iter().partition(|label| is_outside(label.address()));
    let named = |symbol: &object::read::elf::ElfSymbol32<Endianness>| {
        Some((symbol.address() as u32, readable(symbol)?))
    };
    let mut symbols: Vec<_> = functions.iter().chain(&outside).filter_map(named).collect();
    symbols.sort_by_key(|&(address, _)| address);
    (symbols, inside.iter().filter_map(named).collect())
}

fn variables(file: &ElfFile32<Endianness>) -> Vec<(String, Range<u16>)> {
    let in_sram = file.symbols().filter(|symbol| symbol.address() >= DATA && symbol.size() > 0);
    let named = in_sram.filter_map(|symbol| {
        let start = (symbol.address() - DATA) as u16;
        let size = u16::try_from(symbol.size()).unwrap_or(u16::MAX);
        Some((without_part(readable(&symbol)?), start..start.saturating_add(size)))
    });
    named.collect()
}

/// Removes the dot and the number that follow the name of each part of a static that the compiler has split.
fn without_part(name: String) -> String {
    let is_number = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    match name.rsplit_once('.') {
        Some((whole, part)) if is_number(part) => whole.to_owned(),
        _ => name,
    }
}

/// A symbol's name as the source has it; `None` if it has none.
fn readable(symbol: &object::read::elf::ElfSymbol32<Endianness>) -> Option<String> {
    let name = symbol.name().ok().filter(|name| !name.is_empty())?;
    Some(format!("{:#}", rustc_demangle::demangle(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_is_the_first_argument() {
        for (arguments, body) in [
            ("main::{closure#0}, core::convert::Infallible>", "main::{closure#0}"),
            ("run::<2, board::Joints>, (u8, u8)>", "run::<2, board::Joints>"),
            ("fn(&mut kernel::Task) -> u8, u8>", "fn(&mut kernel::Task) -> u8"),
            ("body>", "body"),
        ] {
            assert_eq!(first_argument(arguments), body);
        }
    }
}
