//! Records which instructions of a program were executed, and which way each went.
//!
//! The record is a file with a byte for each word of flash, mapped into memory. All MCUs, threads and
//! processes that run the program write into the same file, and it keeps what they recorded even if one of
//! them fails.

use std::fs::OpenOptions;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};

use memmap2::MmapRaw;

/// The instruction was executed, and the next word after it.
const ON: u8 = 1 << 0;
/// The instruction was executed, and another word than the next after it.
const AWAY: u8 = 1 << 1;

/// The record of one program.
#[derive(Debug)]
pub struct Coverage {
    file: MmapRaw,
}

/// Where the program went from an instruction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ways {
    /// To the next word: a branch that was not taken, or a skip that did not skip.
    pub on: bool,
    /// Elsewhere: a branch that was taken, or a skip that skipped.
    pub away: bool,
}

impl Coverage {
    /// Opens the record in the file at `path`, or begins one there, for a program of `words` words.
    ///
    /// # Errors
    /// The file cannot be opened, made as long as the program, or mapped.
    pub fn open(path: &Path, words: usize) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        file.set_len(words as u64)?;
        Ok(Self { file: MmapRaw::map_raw(&file)? })
    }

    /// Where the program went from the instruction at `address` (in bytes); neither way if it was never
    /// executed.
    pub fn ways(&self, address: u32) -> Ways {
        let seen = self.word(address / 2).map_or(0, |word| word.load(Ordering::Relaxed));
        Ways { on: seen & ON != 0, away: seen & AWAY != 0 }
    }

    fn word(&self, at: u32) -> Option<&AtomicU8> {
        let at = at as usize;
        // SAFETY: the byte lies in the mapping, which lives as long as `self`. Bytes need no alignment, and
        // the mapping is accessed through these atomics only.
        (at < self.file.len()).then(|| unsafe { AtomicU8::from_ptr(self.file.as_mut_ptr().add(at)) })
    }

    /// The instruction at word `at` was executed, and the program goes to word `next`.
    #[inline(always)]
    pub(crate) fn note(&self, at: u32, next: u32) {
        let way = if next == at.wrapping_add(1) { ON } else { AWAY };
        // Most ways are recorded already, and a load is far cheaper than an atomic read-modify-write.
        if let Some(word) = self.word(at).filter(|word| word.load(Ordering::Relaxed) & way == 0) {
            word.fetch_or(way, Ordering::Relaxed);
        }
    }
}

impl Ways {
    /// Whether the instruction was executed at all.
    pub fn is_executed(self) -> bool {
        self.on || self.away
    }

    /// Merges the ways of two places that hold the same code.
    pub fn or(self, other: Self) -> Self {
        Self { on: self.on || other.on, away: self.away || other.away }
    }
}
