//! The kernel's figures: cycles, masked windows and bytes, measured on the test images `bench_*`. The figures
//! of a module are in [`module`], those of the simulator itself in [`simulator`].
//!
//! Cycles are those of the ATmega128, including the response to an interrupt, without the marks around a
//! stretch. Of a figure that is measured more than once, the worst value counts.

mod assembly;
mod bytes;
pub mod concurrency;
mod flash;
mod interrupts;
mod listing;
mod masked;
pub mod module;
pub mod simulator;
mod stretches;
mod table;

use std::cmp::Reverse;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

use crate::image::{Image, ImageError};
use crate::mcu::{Mcu, McuError};
use crate::part::Part;

pub use flash::{Flash, Function};
pub use listing::{Step, listing};
pub use masked::windows;
pub use table::{FIGURES, Figure, PEERS, Peer};

/// The measured value of a figure.
#[derive(Clone, Debug)]
pub struct Measured {
    /// A name in [`FIGURES`].
    pub name: &'static str,
    /// Cycles, bytes or instructions.
    pub value: u64,
    pub counted: Counted,
}

/// What a figure counts.
#[derive(Clone, Debug)]
pub enum Counted {
    /// Cycles, and the stretch of a run in which they passed.
    Cycles(Stretch),
    /// Bytes of flash, and the functions that take them.
    Flash(Flash),
    /// Bytes of RAM, or instructions of the source.
    Number,
}

/// A stretch of an image's run, from power-up with seed 1.
#[derive(Clone, Debug)]
pub struct Stretch {
    pub image: String,
    /// In cycles of the run.
    pub cycles: Range<u64>,
    /// Whether the button is pressed as it begins.
    pub begins_with_press: bool,
}

impl Measured {
    fn cycles(name: &'static str, stretch: Stretch) -> Self {
        Measured { name, value: stretch.length(), counted: Counted::Cycles(stretch) }
    }

    fn number(name: &'static str, value: u64) -> Self {
        Measured { name, value, counted: Counted::Number }
    }
}

impl Stretch {
    fn of(image: &str, cycles: Range<u64>) -> Self {
        Stretch { image: image.into(), cycles, begins_with_press: false }
    }

    fn length(&self) -> u64 {
        self.cycles.end - self.cycles.start
    }
}

/// Keeps the longer of `known` and `new` in `known`.
fn keep_longest(known: &mut Option<Range<u64>>, new: Range<u64>) {
    if known.as_ref().is_none_or(|known| new.end - new.start > known.end - known.start) {
        *known = Some(new);
    }
}

/// Why a figure could not be measured.
#[derive(Debug, Error)]
pub enum BenchError {
    #[error(transparent)]
    Image(#[from] ImageError),
    #[error(transparent)]
    Mcu(#[from] McuError),
    #[error("can't list the test images in {}: {source}; build them with ./x bench", .path.display())]
    NoImages { path: PathBuf, source: std::io::Error },
    #[error("{image}: {reason}")]
    Unmeasurable { image: String, reason: String },
}

/// Measures every figure on the test images in `directory`, in the order of [`FIGURES`].
///
/// # Errors
/// An image does not exist, or does not do what is to be measured.
pub fn measure(directory: &Path) -> Result<Vec<Measured>, BenchError> {
    let images = TestImages { directory };
    let mut measured = stretches::measure(&images)?;
    measured.extend(interrupts::measure(&images)?);
    measured.extend(masked::measure(&images)?);
    measured.extend(bytes::measure(&images)?);
    measured.push(assembly::measure());
    let line = |measured: &Measured| FIGURES.iter().position(|figure| figure.name == measured.name);
    measured.sort_by_key(|measured| (line(measured), Reverse(measured.value)));
    measured.dedup_by_key(|measured| measured.name);
    Ok(measured)
}

/// The directory with the test images.
struct TestImages<'a> {
    directory: &'a Path,
}

impl TestImages<'_> {
    fn image(&self, name: &str) -> Result<Arc<Image>, BenchError> {
        Ok(Arc::new(Image::load(self.directory.join(name).with_extension("elf"))?))
    }

    fn mcu(&self, name: &str) -> Result<Mcu, BenchError> {
        Ok(Mcu::new(Part::ATMEGA128, self.image(name)?, 1)?)
    }

    /// The names of all images, sorted.
    fn names(&self) -> Result<Vec<String>, BenchError> {
        let list = || {
            let paths = std::fs::read_dir(self.directory)?.map(|entry| Ok(entry?.path()));
            paths.collect::<Result<Vec<_>, std::io::Error>>()
        };
        let paths = list().map_err(|source| BenchError::NoImages { path: self.directory.into(), source })?;
        let mut names: Vec<_> = paths
            .iter()
            .filter(|path| path.extension().is_some_and(|extension| extension == "elf"))
            .filter_map(|path| path.file_stem()?.to_str().map(str::to_owned))
            .collect();
        names.sort();
        Ok(names)
    }
}

fn unmeasurable(image: &str, reason: impl Into<String>) -> BenchError {
    BenchError::Unmeasurable { image: image.into(), reason: reason.into() }
}

/// The mark at the end of a stretch has this bit set besides the stretch's number.
const END: u8 = 0x80;

/// Cycles of the `ldi` of a mark. The cycle of a mark is that at which its `out` begins.
const BEFORE_OUT: u64 = 1;

/// Cycles of a mark's `out`.
const OUT: u64 = 1;
