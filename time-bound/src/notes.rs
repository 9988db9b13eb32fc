//! How often loops go round, written down by hand.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use stack_bound::Image;
use thiserror::Error;

/// How often a loop goes round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turns {
    /// Each time that the loop is entered, its first instruction is executed so often at most.
    AtMost(u64),
    /// The loop's first instruction is executed so often at most in a call of the function, or in a job,
    /// however often the loop is entered.
    InAll(u64),
    /// The loop is a task's main loop: each iteration is a job.
    Job,
}

/// A loop's note, with those of the loops inside of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Noted {
    pub turns: Turns,
    pub inner: Vec<Noted>,
}

/// A text file of notes, one a line; a line that begins with `#` is a comment. Functions are named as this
/// tool names them; a `*` stands for [the rest of a name](Image::function).
///
/// ```text
/// tasks::link::receive::run = 4 job(4(7(32) 2))
/// firmware_master::__vector_34::handler -> kernel::post = 1
/// ```
/// A function's loops are listed in the order of flash; loops in brackets after one are inside of it. If
/// another compiler makes other loops, the notes no longer fit, and are refused. The second line says how
/// often a function calls another at most, in each call of its own or in each job.
#[derive(Debug, Default)]
pub struct Notes {
    /// By the function's name.
    pub(crate) loops: BTreeMap<String, Vec<Noted>>,
    /// By the start addresses of caller and callee.
    pub(crate) calls: BTreeMap<(u32, u32), u64>,
}

/// Why the notes cannot be used.
#[derive(Debug, Error)]
pub enum NoteError {
    #[error("cannot read {}: {source}", .path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("line {line}: not \"function = turns\", as in \"function = 8 job(3 40)\"")]
    Malformed { line: usize },
    #[error("line {line}: the image has no function {name}: take the line out, or correct the name")]
    NoFunction { line: usize, name: String },
    #[error("line {line}: {name} has a line already: take one of the lines out")]
    Twice { line: usize, name: String },
}

impl Notes {
    /// Reads notes about an image.
    ///
    /// # Errors
    /// The file cannot be read, a line is no note, or names a function that the image does not have.
    pub fn load(path: impl AsRef<Path>, image: &Image) -> Result<Self, NoteError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|source| NoteError::Unreadable { path: path.to_owned(), source })?;
        Self::parse(&text, image)
    }

    /// Reads notes that are in memory.
    ///
    /// # Errors
    /// A line is no note, or names a function that the image does not have.
    pub fn parse(text: &str, image: &Image) -> Result<Self, NoteError> {
        let mut notes = Notes::default();
        for (line, note) in stack_bound::notes(text) {
            let (name, loops) = note.rsplit_once('=').ok_or(NoteError::Malformed { line })?;
            let name = name.trim().to_owned();
            let function = |name: &str| {
                let no_function = || NoteError::NoFunction { line, name: name.trim().to_owned() };
                image.function(name.trim()).ok_or_else(no_function)
            };
            if let Some((caller, callee)) =
                name.rsplit_once(" -> ").filter(|_| image.function(&name).is_none())
            {
                let most = loops.trim().parse().map_err(|_| NoteError::Malformed { line })?;
                if notes.calls.insert((function(caller)?, function(callee)?), most).is_some() {
                    return Err(NoteError::Twice { line, name });
                }
                continue;
            }
            let mut rest = loops.trim();
            let noted = sequence(&mut rest).filter(|noted| rest.is_empty() && !noted.is_empty());
            let noted = noted.ok_or(NoteError::Malformed { line })?;
            let no_function = || NoteError::NoFunction { line, name: name.clone() };
            let whole = image.whole_name(&name).ok_or_else(no_function)?;
            if notes.loops.insert(whole.to_owned(), noted).is_some() {
                return Err(NoteError::Twice { line, name });
            }
        }
        Ok(notes)
    }
}

/// Takes loops off the text, up to its end or a closing bracket.
fn sequence(text: &mut &str) -> Option<Vec<Noted>> {
    let mut noted = Vec::new();
    loop {
        *text = text.trim_start();
        if text.is_empty() || text.starts_with(')') {
            return Some(noted);
        }
        let end = text.find([' ', '(', ')']).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        let turns = match word {
            "job" => Turns::Job,
            number => match number.strip_suffix('!') {
                Some(number) => Turns::InAll(positive(number)?),
                None => Turns::AtMost(positive(number)?),
            },
        };
        *text = rest;
        let mut inner = Vec::new();
        if let Some(rest) = text.strip_prefix('(') {
            *text = rest;
            inner = sequence(text)?;
            *text = text.strip_prefix(')')?;
        }
        noted.push(Noted { turns, inner });
    }
}

fn positive(number: &str) -> Option<u64> {
    number.parse().ok().filter(|&number| number > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(mut text: &str) -> Option<Vec<Noted>> {
        sequence(&mut text).filter(|_| text.is_empty())
    }

    #[test]
    fn loops_in_loops() {
        let plain = |turns| Noted { turns: Turns::AtMost(turns), inner: vec![] };
        let inner = Noted { turns: Turns::AtMost(3), inner: vec![plain(40)] };
        let job = Noted { turns: Turns::Job, inner: vec![inner, plain(2)] };
        assert_eq!(parse("8 job(3(40) 2)"), Some(vec![plain(8), job]));
        assert_eq!(parse("7!"), Some(vec![Noted { turns: Turns::InAll(7), inner: vec![] }]));
    }

    #[test]
    fn what_is_no_note() {
        for text in ["0", "0!", "!", "eight", "8(", "8)", "(8)", "-1", "8((2))"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
