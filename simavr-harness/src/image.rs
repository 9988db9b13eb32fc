//! A program as the linker leaves it: the contents of its flash, and its symbols.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use instruction_set::Instruction;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind, SymbolSection, elf};
use thiserror::Error;

use crate::coverage::Coverage;
use crate::cpu::Cpu;
use crate::interpreter;

mod code;

pub use code::{Code, Form, Kind};

/// An AVR program read from an ELF file.
#[derive(Clone, Debug)]
pub struct Image {
    flash: Vec<u8>,
    program: Vec<Instruction>,
    symbols: BTreeMap<String, Symbol>,
    coverage: Option<Arc<Coverage>>,
    /// The whole flash of the first MCU that ran it.
    shared: OnceLock<Vec<u8>>,
}

/// A symbol of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Symbol {
    pub place: Place,
    /// Size in bytes; 0 if the program does not give it.
    pub size: u16,
    /// Whether it is a label within a function of assembly, local to its file.
    pub is_label: bool,
    /// Whether the program marks it as a function.
    pub is_function: bool,
}

/// The memory that a symbol is in, and its address there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Byte address in flash.
    Flash(u32),
    /// Address in the data space.
    Data(u16),
    /// Address in the EEPROM.
    Eeprom(u16),
}

/// Why there is no image.
#[derive(Debug, Error)]
pub enum ImageError {
    #[error(
        "cannot read the image {}: {source}; ./x build builds the robot's images, ./x bench the test images",
        .path.display()
    )]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", .path.display())]
    Bad { path: PathBuf, source: Box<ImageError> },
    #[error("not an ELF file ({0}); build the images with ./x build")]
    NotElf(#[from] object::Error),
    #[error("an ELF file for machine {0}, not for an AVR; build the images with ./x build")]
    NotAvr(u16),
    #[error("the image has nothing to put into flash; build the images with ./x build")]
    Empty,
    #[error("a segment reaches beyond the end of the file; build the images with ./x build")]
    Cut,
}

/// The linker of avr-gcc has one address space, in which data, EEPROM and fuses begin at these addresses.
const DATA: u32 = 0x80_0000;
const EEPROM: u32 = 0x81_0000;
const FUSES: u32 = 0x82_0000;
const FLASH: Range<u32> = 0..DATA;

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// The file cannot be read, or is not an AVR program.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ImageError> {
        let path = path.as_ref();
        let bytes = read(path).map_err(|source| ImageError::Unreadable { path: path.to_owned(), source })?;
        Self::parse(&bytes).map_err(|source| ImageError::Bad { path: path.to_owned(), source: source.into() })
    }

    /// Reads an ELF file that is in memory.
    ///
    /// # Errors
    /// It is not an AVR program.
    pub fn parse(bytes: &[u8]) -> Result<Self, ImageError> {
        let file = ElfFile32::<Endianness>::parse(bytes)?;
        let endian = file.endian();
        let machine = file.elf_header().e_machine.get(endian);
        if machine != elf::EM_AVR {
            return Err(ImageError::NotAvr(machine));
        }
        let mut flash = Vec::new();
        for segment in file.elf_program_headers() {
            // Initial values of .data are stored in flash, at the segment's physical address.
            let at = segment.p_paddr(endian);
            if segment.p_type(endian) != elf::PT_LOAD || !FLASH.contains(&at) {
                continue;
            }
            let content = segment.data(endian, bytes).map_err(|()| ImageError::Cut)?;
            place(&mut flash, at as usize, content);
        }
        if flash.is_empty() {
            return Err(ImageError::Empty);
        }
        let symbols = file.symbols().filter_map(named_symbol).collect();
        Ok(Self {
            program: interpreter::decode(&flash),
            flash,
            symbols,
            coverage: None,
            shared: OnceLock::new(),
        })
    }

    /// The same image, to be executed by simavr's own interpreter, which decodes an instruction each time
    /// that it executes it.
    pub fn undecoded(self) -> Self {
        Self { program: Vec::new(), ..self }
    }

    /// A program without symbols. If it is not `decoded`, simavr's interpreter executes it.
    #[cfg(test)]
    pub(crate) fn of_flash(flash: Vec<u8>, decoded: bool) -> Self {
        let program = if decoded { interpreter::decode(&flash) } else { Vec::new() };
        Self { program, flash, symbols: BTreeMap::new(), coverage: None, shared: OnceLock::new() }
    }

    /// Records from now on, in the file at `path`, which instructions MCUs execute that run this image. The
    /// file keeps what it has recorded already, of a program of this size.
    ///
    /// # Errors
    /// The file cannot be opened or mapped.
    pub fn record_coverage(&mut self, path: &Path) -> std::io::Result<()> {
        self.coverage = Some(Arc::new(Coverage::open(path, self.flash.len() / 2)?));
        Ok(())
    }

    /// The record of coverage, if there is one.
    pub fn coverage(&self) -> Option<&Coverage> {
        self.coverage.as_deref()
    }

    /// The contents of the flash, from address 0.
    pub fn flash(&self) -> &[u8] {
        &self.flash
    }

    /// The flash of `mcu`, which runs this image. All MCUs of its part share it, so that it stays in the
    /// host's cache. `None` for a program that may write its flash.
    pub(crate) fn shared_flash(&self, mcu: Cpu) -> Option<&[u8]> {
        // `decode` returns nothing for a program with SPM.
        let has_no_spm = !self.program.is_empty();
        has_no_spm.then(|| self.shared.get_or_init(|| mcu.with_flash(<[u8]>::to_vec)).as_slice())
    }

    /// The flash, decoded; empty for a program that is left to simavr.
    pub(crate) fn program(&self) -> &[Instruction] {
        &self.program
    }

    /// The symbol of this name.
    pub fn symbol(&self, name: &str) -> Option<Symbol> {
        self.symbols.get(name).copied()
    }

    /// All symbols by name.
    pub fn symbols(&self) -> impl Iterator<Item = (&str, Symbol)> {
        self.symbols.iter().map(|(name, &symbol)| (name.as_str(), symbol))
    }

    /// The name of the last function or label in flash at or before `address` (in bytes), and the distance
    /// from it to `address`.
    pub fn function_at(&self, address: u32) -> Option<(&str, u32)> {
        self.symbols()
            .filter_map(|(name, symbol)| match symbol.place {
                Place::Flash(start) if start <= address => Some((name, address - start)),
                _ => None,
            })
            .min_by_key(|&(_, distance)| distance)
    }
}

/// The content of a regular file. A read of a pipe without a writer would never end.
fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    if path.metadata()?.is_file() {
        std::fs::read(path)
    } else {
        Err(std::io::Error::other("it is not a regular file"))
    }
}

/// Copies `content` to `at`. A gap before it becomes unprogrammed flash.
fn place(flash: &mut Vec<u8>, at: usize, content: &[u8]) {
    let end = at + content.len();
    if flash.len() < end {
        flash.resize(end, 0xff);
    }
    flash[at..end].copy_from_slice(content);
}

/// A symbol that stands for a place. Constants and file names have no section, and give `None`.
fn named_symbol<'data>(symbol: impl ObjectSymbol<'data>) -> Option<(String, Symbol)> {
    if !matches!(symbol.section(), SymbolSection::Section(_)) {
        return None;
    }
    let name = symbol.name().ok().filter(|name| !name.is_empty())?;
    let address = u32::try_from(symbol.address()).ok()?;
    let offset = |start| u16::try_from(address - start).ok();
    let place = match address {
        ..DATA => Place::Flash(address),
        DATA..EEPROM => Place::Data(offset(DATA)?),
        EEPROM..FUSES => Place::Eeprom(offset(EEPROM)?),
        _ => return None,
    };
    let size = u16::try_from(symbol.size()).unwrap_or(u16::MAX);
    let is_label = symbol.is_local() && size == 0;
    Some((name.to_owned(), Symbol { place, size, is_label, is_function: symbol.kind() == SymbolKind::Text }))
}
