//! Facts that the machine code does not show, written down by hand.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::{Image, notes};

/// A text file of notes, one a line; a line that begins with `#` is a comment. Functions are named as this
/// tool names them; a `*` stands for [the rest of a name](Image::function).
///
/// ```text
/// <hormone::task::Here as hormone::module::Module>::trace => board::debug::mark
/// factorial = 40
/// ```
/// The first line says where an indirect call leads; a caller with several callees has a line for each, and
/// all functions of a callee's name count. The second says that a function and all its callees use at most
/// this many bytes. Nothing checks that number. A function has one such line.
#[derive(Default)]
pub struct Annotations {
    /// The callees of a caller's indirect calls, by the caller's name.
    pub(crate) calls: BTreeMap<String, BTreeSet<u32>>,
    /// The bytes that a function uses, by its start address.
    pub(crate) bytes: BTreeMap<u32, u16>,
}

/// Why the notes cannot be used.
#[derive(Debug, Error)]
pub enum AnnotationError {
    #[error("cannot read {}: {source}", .path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("line {line}: neither \"caller => callee\" nor \"function = bytes\", {} bytes at most", u16::MAX)]
    Malformed { line: usize },
    #[error("line {line}: the image has no function {name}: take the line out, or correct the name")]
    NoFunction { line: usize, name: String },
    #[error("line {line}: the bytes of {name} are noted already: take one of the lines out")]
    Twice { line: usize, name: String },
}

impl Annotations {
    /// Reads notes about an image.
    ///
    /// # Errors
    /// The file cannot be read, a line is no note, or names a function that the image does not have, or whose
    /// bytes are noted already.
    pub fn load(path: impl AsRef<Path>, image: &Image) -> Result<Self, AnnotationError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|source| AnnotationError::Unreadable { path: path.to_owned(), source })?;
        Self::parse(&text, image)
    }

    /// Reads notes that are in memory.
    ///
    /// # Errors
    /// A line is no note, or names a function that the image does not have, or whose bytes are noted already.
    pub fn parse(text: &str, image: &Image) -> Result<Self, AnnotationError> {
        let mut annotations = Annotations::default();
        for (line, note) in notes(text) {
            let function = |name: &str| {
                let name = name.trim();
                image
                    .function(name)
                    .ok_or_else(|| AnnotationError::NoFunction { line, name: name.to_owned() })
            };
            if let Some((caller, callee)) = note.split_once("=>") {
                // Calls are looked up by this name. It matters where a function has several names.
                let caller = image.name(function(caller)?).to_owned();
                function(callee)?;
                annotations.calls.entry(caller).or_default().extend(image.functions(callee.trim()));
            } else if let Some((name, bytes)) = note.rsplit_once('=') {
                let bytes = bytes.trim().parse().map_err(|_| AnnotationError::Malformed { line })?;
                if annotations.bytes.insert(function(name)?, bytes).is_some() {
                    return Err(AnnotationError::Twice { line, name: name.trim().to_owned() });
                }
            } else {
                return Err(AnnotationError::Malformed { line });
            }
        }
        Ok(annotations)
    }
}
