//! A fault: lines of the kernel, and their replacement.

use std::fs;
use std::path::Path;

use serde::Deserialize;

/// A fault of the list.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    pub name: String,
    /// The path below `kernel/src`.
    pub file: String,
    /// Whole lines, without their indentation. They appear in the file exactly once.
    pub from: String,
    /// The lines that replace them.
    #[serde(default)]
    pub to: String,
    /// What the faulty kernel does.
    pub means: String,
    /// The tests that look for the fault, in this order.
    #[serde(default = "model")]
    pub tests: Vec<String>,
    /// Why none of these tests can find it.
    pub not_caught: Option<String>,
}

fn model() -> Vec<String> {
    vec![crate::trial::MODEL.to_owned()]
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    fault: Vec<Fault>,
}

/// The faults of the list in `file`.
pub fn read(file: &Path) -> Result<Vec<Fault>, String> {
    let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let list: List = toml::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(list.fault)
}

impl Fault {
    /// The text of the file with the fault in it.
    pub fn plant(&self, text: &str) -> Result<String, String> {
        let lines: Vec<_> = text.lines().collect();
        let wanted: Vec<_> = self.from.lines().map(str::trim).collect();
        let places = (0..lines.len()).filter(|&start| {
            let here = lines[start..].iter().map(|line| line.trim()).take(wanted.len());
            here.eq(wanted.iter().copied())
        });
        let places: Vec<_> = places.collect();
        let &[start] = &places[..] else {
            return Err(format!(
                "fault {}: its lines occur {} times in kernel/src/{}, not once: update them in \
                 tests/faults/faults.toml\n{}",
                self.name,
                places.len(),
                self.file,
                self.from
            ));
        };
        let end = start + wanted.len();
        let planted =
            lines[..start].iter().copied().chain(self.to.lines()).chain(lines[end..].iter().copied());
        Ok(planted.flat_map(|line| [line, "\n"]).collect())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::{LIST, ROOT};

    fn fault(from: &str, to: &str) -> Fault {
        let words = || "word".to_owned();
        Fault {
            name: words(),
            file: words(),
            from: from.to_owned(),
            to: to.to_owned(),
            means: words(),
            tests: model(),
            not_caught: None,
        }
    }

    #[test]
    fn each_fault_of_the_list_fits_the_kernel() {
        let faults = read(Path::new(LIST)).unwrap();
        assert!(faults.len() >= 30);
        let mut names = HashSet::new();
        let mut wrong = Vec::new();
        for fault in faults {
            let file = Path::new(ROOT).join("kernel/src").join(&fault.file);
            let text = fs::read_to_string(&file).unwrap_or_default();
            match fault.plant(&text) {
                Ok(planted) => assert_ne!(planted, text, "{} changes nothing", fault.name),
                Err(error) => wrong.push(error),
            }
            assert!(names.insert(fault.name.clone()), "{} is the name of two", fault.name);
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn lines_are_replaced_whatever_their_indentation() {
        let text = "one\n    two\n        three\n    two\n";
        assert_eq!(fault("two\nthree", "  four").plant(text), Ok("one\n  four\n    two\n".to_owned()));
        assert_eq!(fault("three", "").plant(text), Ok("one\n    two\n    two\n".to_owned()));
    }

    #[test]
    fn lines_that_do_not_stand_there_once_are_an_error() {
        let text = "one\n    two\n    two\n";
        assert!(fault("two", "three").plant(text).unwrap_err().contains("2 times"));
        assert!(fault("tw", "three").plant(text).unwrap_err().contains("0 times"));
        assert!(fault("two\nthree", "four").plant(text).unwrap_err().contains("0 times"));
    }
}
