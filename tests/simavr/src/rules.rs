//! The master's image with a rule of the centipede's table in flash replaced by another one.

use hormone::rule::Rule;

use crate::images;
use table::table;

#[path = "../../../simulation/tests/table/mod.rs"]
pub mod table;

/// A rule as it lies in flash.
const BYTES: usize = size_of::<Rule>();

/// The master's image, and where the table begins in it.
pub struct Master {
    file: Vec<u8>,
    start: usize,
}

impl Master {
    /// The image that modules are flashed with.
    ///
    /// # Panics
    /// When it is not there, or does not have the table exactly once. Fields have the same layout there as on
    /// the host.
    pub fn read() -> Self {
        let file = std::fs::read(images().join("firmware-master.elf")).expect("./x build leaves it");
        let whole: Vec<u8> = table().into_iter().flat_map(bytes).collect();
        let places: Vec<usize> =
            (0..file.len() - whole.len()).filter(|&at| file[at..].starts_with(&whole)).collect();
        let &[start] = &places[..] else { panic!("the table lies at {places:?}") };
        Master { file, start }
    }

    /// The unchanged ELF file.
    pub fn file(&self) -> &[u8] {
        &self.file
    }

    /// The ELF file with this rule at a place of the table.
    pub fn with(&self, place: usize, rule: Rule) -> Vec<u8> {
        let mut file = self.file.clone();
        let at = self.start + place * BYTES;
        file[at..at + BYTES].copy_from_slice(&bytes(rule));
        file
    }
}

fn bytes(rule: Rule) -> [u8; BYTES] {
    // SAFETY: a rule has six bytes of data and no room between them.
    unsafe { std::mem::transmute(rule) }
}
