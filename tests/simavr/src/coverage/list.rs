//! The list of known gaps, by their reasons.
//!
//! A line without indentation is a reason; the gaps with that reason follow:
//!
//! ```text
//! The counter has no more than this many bits.
//!     kernel_wait 0x1a..0x20 never executed
//! ```

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use super::gap::Gap;
use super::variants::Found;

/// The line above the gaps that wait for a reason.
const NO_REASON: &str = "No reason yet.";

/// The prefix of the reason for gaps that chance fills in some runs.
const BY_CHANCE: &str = "By chance:";

/// The known gaps, and the reason for each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct List {
    reasons: BTreeMap<Gap, String>,
}

/// A difference between the list and the gaps found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Complaint {
    /// A gap that is not listed.
    New(Found),
    /// A gap that is listed, and does not exist.
    Gone(Gap),
    /// A gap that is listed without a reason.
    Unreasoned(Found),
}

impl Complaint {
    /// What to do about it, where the list is the file at `path`.
    pub fn advice(&self, path: &Path) -> String {
        let list = path.display();
        match self {
            Complaint::New(_) => format!(
                "Write a test that covers each gap that is not listed. If no test can, list the gap with \
                 ./x coverage --accept, and give the reason in {list}"
            ),
            Complaint::Gone(_) => format!(
                "Take each gap that does not exist out of the list with ./x coverage --accept, or by hand: \
                 {list}"
            ),
            Complaint::Unreasoned(_) => format!("Give the reason for each gap that has none, in {list}"),
        }
    }
}

impl List {
    /// Reads a list.
    ///
    /// # Errors
    /// The number of the line that is malformed.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (mut reasons, mut reason) = (BTreeMap::new(), "");
        for (number, line) in (1..).zip(text.lines()) {
            let entry = line.trim();
            if entry.is_empty() {
            } else if !line.starts_with(' ') {
                reason = entry;
            } else {
                let gap = Gap::parse(entry).filter(|_| !reason.is_empty()).ok_or_else(|| {
                    format!(
                        "line {number} is not a gap (FUNCTION 0x1a..0x20 never executed) below a reason: \
                         {line}"
                    )
                })?;
                let reason = if reason == NO_REASON { "" } else { reason };
                if reasons.insert(gap, reason.to_owned()).is_some() {
                    return Err(format!("line {number} lists a gap for the second time: {line}"));
                }
            }
        }
        Ok(List { reasons })
    }

    /// The differences between the list and the gaps found. There are none if every gap is listed with its
    /// reason, and no others except those of chance.
    pub fn check(&self, found: &[Found]) -> Vec<Complaint> {
        let of_found = found.iter().filter_map(|found| match self.reasons.get(&found.gap) {
            None => Some(Complaint::New(found.clone())),
            Some(reason) if reason.is_empty() => Some(Complaint::Unreasoned(found.clone())),
            Some(_) => None,
        });
        let gone = self.reasons.iter().filter(|(gap, reason)| {
            !reason.starts_with(BY_CHANCE) && found.iter().all(|found| found.gap != **gap)
        });
        of_found.chain(gone.map(|(gap, _)| Complaint::Gone(gap.clone()))).collect()
    }

    /// The list of the gaps found. Gaps that stay keep their reasons, and gaps of chance stay. Also returns
    /// the dropped gaps with their reasons.
    pub fn accept(mut self, found: &[Found]) -> (Self, Vec<(Gap, String)>) {
        let mut reason = |found: &Found| self.reasons.remove(&found.gap).unwrap_or_default();
        let found: Vec<_> = found.iter().map(|found| (found.gap.clone(), reason(found))).collect();
        let (by_chance, dropped): (Vec<_>, Vec<_>) = self
            .reasons
            .into_iter()
            .filter(|(_, reason)| !reason.is_empty())
            .partition(|(_, reason)| reason.starts_with(BY_CHANCE));
        (List { reasons: found.into_iter().chain(by_chance).collect() }, dropped)
    }
}

/// Writes the format that [`List::parse`] reads.
impl fmt::Display for List {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut by_reason: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for (gap, reason) in &self.reasons {
            let reason = if reason.is_empty() { NO_REASON } else { reason };
            by_reason.entry(reason).or_default().push(gap);
        }
        for (number, (reason, gaps)) in by_reason.into_iter().enumerate() {
            writeln!(f, "{}{reason}", if number == 0 { "" } else { "\n" })?;
            gaps.into_iter().try_for_each(|gap| writeln!(f, "    {gap}"))?;
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

    const TEXT: &str = "Guards against what the hardware can't do.
    kernel_wait 0x2..0x4 never executed

No reason yet.
    kernel_wait 0x8..0xa never skips
";

    #[test]
    fn a_list_reads_as_it_was_written() {
        let list = List::parse(TEXT).expect("it is a list");
        assert_eq!(list.reasons.len(), 2);
        assert_eq!(list.to_string(), TEXT);
    }

    #[test]
    fn what_is_no_list_is_told_by_its_line() {
        for (text, line) in [
            ("    kernel_wait 0x2..0x4 never executed", "line 1"),
            ("Reason.\n    0x2 never: x", "line 2"),
            ("Reason.\n    f 0x2..0x4 never skips\nOther.\n    f 0x2..0x4 never skips", "line 4"),
        ] {
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
    fn each_complaint_comes_with_its_own_advice() {
        let advice = |complaint: Complaint| complaint.advice(Path::new("list.txt"));
        let gap = || found(6, What::AlwaysBranches);
        assert!(advice(Complaint::New(gap())).starts_with("Write a test"));
        assert!(advice(Complaint::Unreasoned(gap())).starts_with("Give the reason"));
        assert!(advice(Complaint::Gone(gap().gap)).starts_with("Take each gap that does not exist out"));
    }

    #[test]
    fn a_gap_that_chance_fills_may_be_gone() {
        let gap = "kernel_wait 0x2..0x4 never executed";
        let complaints = |reason| List::parse(&format!("{reason}\n    {gap}")).expect("a list").check(&[]);
        assert_eq!(complaints("By chance: seldom."), []);
        assert_eq!(complaints("Never."), [Complaint::Gone(found(2, What::NeverExecuted).gap)]);
    }

    #[test]
    fn accepted_gaps_keep_their_reasons() {
        let list = List::parse(TEXT).expect("it is a list");
        let stays = found(2, What::NeverExecuted);
        let (accepted, dropped) = list.clone().accept(&[stays.clone(), found(6, What::NeverBranches)]);
        assert_eq!(accepted.reasons[&stays.gap], "Guards against what the hardware can't do.");
        assert_eq!((accepted.reasons.len(), dropped.len()), (2, 0));
        let (_, dropped) = list.accept(&[]);
        assert_eq!(dropped.len(), 1, "and one had none");
    }
}
