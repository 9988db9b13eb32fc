//! The list of gaps that are known, each with its reason.
//!
//! A line at the margin is the name of a function; below it stands a line for each of its gaps:
//!
//! ```text
//! kernel_wait
//!     0x1a..0x20 never executed: why no test can come here
//! ```

use std::collections::BTreeMap;
use std::fmt;

use super::gap::Gap;
use super::variants::Found;

/// The gaps that are known, and why.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct List {
    reasons: BTreeMap<Gap, String>,
}

/// What is wrong between the list and what was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Complaint {
    /// A gap that is not listed.
    New(Found),
    /// It is listed, and there is no such gap.
    Gone(Gap),
    /// It is listed without a reason.
    Unreasoned(Found),
}

impl List {
    /// Reads a list.
    ///
    /// # Errors
    /// The line that is none, by its number.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (mut reasons, mut function) = (BTreeMap::new(), None);
        for (number, line) in (1..).zip(text.lines()) {
            let entry = line.trim_start();
            if entry.is_empty() {
            } else if entry.len() == line.len() {
                function = Some(line);
            } else {
                let (gap, reason) = entry.split_once(':').unwrap_or((entry, ""));
                let gap = function.and_then(|function| Gap::parse(function, gap.trim_end()));
                let gap = gap.ok_or_else(|| {
                    format!(
                        "line {number} is no gap of a function (0x1a..0x20 never executed: reason): {line}"
                    )
                })?;
                reasons.insert(gap, reason.trim().to_owned());
            }
        }
        Ok(List { reasons })
    }

    /// Where the list is wrong about what was found; nothing where every gap is listed with its reason, and
    /// no other.
    pub fn check(&self, found: &[Found]) -> Vec<Complaint> {
        let of_found = found.iter().filter_map(|found| match self.reasons.get(&found.gap) {
            None => Some(Complaint::New(found.clone())),
            Some(reason) if reason.is_empty() => Some(Complaint::Unreasoned(found.clone())),
            Some(_) => None,
        });
        let gone = self.reasons.keys().filter(|gap| found.iter().all(|found| found.gap != **gap));
        of_found.chain(gone.cloned().map(Complaint::Gone)).collect()
    }

    /// The list of what was found. Reasons stay with the gaps that stay; also returns the reasons of those
    /// that do not.
    pub fn accept(mut self, found: &[Found]) -> (Self, Vec<(Gap, String)>) {
        let mut reason = |found: &Found| self.reasons.remove(&found.gap).unwrap_or_default();
        let reasons = found.iter().map(|found| (found.gap.clone(), reason(found))).collect();
        let dropped = self.reasons.into_iter().filter(|(_, reason)| !reason.is_empty()).collect();
        (List { reasons }, dropped)
    }
}

/// As [`List::parse`] reads it.
impl fmt::Display for List {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut function = "";
        for (gap, reason) in &self.reasons {
            if gap.function != function {
                function = &gap.function;
                writeln!(f, "{function}")?;
            }
            writeln!(f, "{}", format!("    {}: {reason}", gap.within_function()).trim_end())?;
        }
        Ok(())
    }
}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Complaint::New(found) => write!(f, "{found}: not listed"),
            Complaint::Gone(gap) => write!(f, "{gap}: listed, but there is no such gap"),
            Complaint::Unreasoned(found) => write!(f, "{found}: listed without a reason"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::gap::What;
    use super::*;

    fn found(from: u32, what: What) -> Found {
        let gap = Gap::new("kernel_wait", from..from + 2, what);
        Found { gap, image: "one.elf".to_owned(), address: 0x100 + from }
    }

    const TEXT: &str = "kernel_wait
    0x2..0x4 never executed: guards against what the hardware can't do
    0x8..0xa never skips:
";

    #[test]
    fn a_list_reads_as_it_was_written() {
        let list = List::parse(TEXT).expect("it is a list");
        assert_eq!(list.reasons.len(), 2);
        assert_eq!(List::parse(&list.to_string()), Ok(list));
    }

    #[test]
    fn what_is_no_list_is_told_by_its_line() {
        for (text, line) in [("    0x2..0x4 never executed", "line 1"), ("f\n    0x2 never: x", "line 2")] {
            assert!(List::parse(text).is_err_and(|error| error.starts_with(line)), "{text}");
        }
    }

    #[test]
    fn each_gap_is_listed_with_a_reason_and_no_other() {
        let list = List::parse(TEXT).expect("it is a list");
        let (known, unreasoned) = (found(2, What::NeverExecuted), found(8, What::NeverSkips));
        let new = found(6, What::AlwaysBranches);
        let complaints = list.check(&[known.clone(), new.clone(), unreasoned.clone()]);
        assert_eq!(complaints, [Complaint::New(new), Complaint::Unreasoned(unreasoned.clone())]);
        assert_eq!(
            list.check(std::slice::from_ref(&unreasoned)),
            [Complaint::Unreasoned(unreasoned), Complaint::Gone(known.gap)]
        );
    }

    #[test]
    fn accepted_gaps_keep_their_reasons() {
        let list = List::parse(TEXT).expect("it is a list");
        let stays = found(2, What::NeverExecuted);
        let (accepted, dropped) = list.clone().accept(&[stays.clone(), found(6, What::NeverBranches)]);
        assert_eq!(accepted.reasons[&stays.gap], "guards against what the hardware can't do");
        assert_eq!((accepted.reasons.len(), dropped.len()), (2, 0));
        let (_, dropped) = list.accept(&[]);
        assert_eq!(dropped.len(), 1, "and one had none");
    }
}
