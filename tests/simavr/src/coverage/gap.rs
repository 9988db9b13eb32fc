//! The parts of a function that no test executes.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// Consecutive instructions that are never executed, or an instruction that goes one way only, with those
/// after it that are therefore never executed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Gap {
    pub function: String,
    /// The offset of the first instruction from the function's start, in bytes, and the end of the last one.
    pub from: u32,
    pub to: u32,
    pub what: What,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum What {
    NeverExecuted,
    AlwaysBranches,
    NeverBranches,
    AlwaysSkips,
    NeverSkips,
}

impl What {
    const ALL: [What; 5] =
        [What::NeverExecuted, What::AlwaysBranches, What::NeverBranches, What::AlwaysSkips, What::NeverSkips];
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            What::NeverExecuted => "never executed",
            What::AlwaysBranches => "always branches",
            What::NeverBranches => "never branches",
            What::AlwaysSkips => "always skips",
            What::NeverSkips => "never skips",
        })
    }
}

impl FromStr for What {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        Self::ALL.into_iter().find(|what| what.to_string() == text).ok_or(())
    }
}

impl Gap {
    pub fn new(function: &str, Range { start, end }: Range<u32>, what: What) -> Self {
        Gap { function: function.to_owned(), from: start, to: end, what }
    }

    /// Whether, according to this gap, the program never reaches the next instruction from here.
    pub fn leads_nowhere(&self) -> bool {
        matches!(self.what, What::NeverExecuted | What::AlwaysBranches | What::AlwaysSkips)
    }

    /// Reads the format of [`fmt::Display`].
    pub fn parse(text: &str) -> Option<Self> {
        let mut words = text.rsplitn(4, ' ');
        let (second, first) = (words.next()?, words.next()?);
        let (range, function) = (words.next()?, words.next()?);
        let what = format!("{first} {second}");
        let (from, to) = range.split_once("..")?;
        let number = |text: &str| u32::from_str_radix(text.strip_prefix("0x")?, 16).ok();
        Some(Gap::new(function, number(from)?..number(to)?, what.parse().ok()?))
    }
}

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Gap { function, from, to, what } = self;
        write!(f, "{function} {from:#x}..{to:#x} {what}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_reads_as_it_was_written() {
        for what in What::ALL {
            let gap = Gap::new("<kernel::a as kernel::b>::c", 0x1a..0x20, what);
            assert_eq!(Gap::parse(&gap.to_string()), Some(gap));
        }
        for wrong in ["", "0x1a..0x20", "0x1a never executed", "1a..20 never executed", "0x1..0x2 seldom run"]
        {
            assert_eq!(Gap::parse(wrong), None, "{wrong}");
            assert_eq!(Gap::parse(&format!("kernel_wait {wrong}")), None, "{wrong}");
        }
        assert_eq!(Gap::parse("0x1a..0x20 never executed"), None, "of no function");
    }
}
