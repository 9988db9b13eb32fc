//! What of a function no test executes.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// Instructions in a row that are never executed, or one that goes one way only.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Gap {
    pub function: String,
    /// Offset of the first instruction from the function's begin, in bytes, and the end of the last one.
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

    /// Without the function's name: `0x1a..0x20 never executed`.
    pub fn within_function(&self) -> String {
        format!("{:#x}..{:#x} {}", self.from, self.to, self.what)
    }

    /// What [`within_function`](Self::within_function) of a gap in that function gives.
    pub fn parse(function: &str, text: &str) -> Option<Self> {
        let (range, what) = text.split_once(' ')?;
        let (from, to) = range.split_once("..")?;
        let number = |text: &str| u32::from_str_radix(text.strip_prefix("0x")?, 16).ok();
        Some(Gap::new(function, number(from)?..number(to)?, what.parse().ok()?))
    }
}

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} {}", self.function, self.within_function())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_reads_as_it_was_written() {
        for what in What::ALL {
            let gap = Gap::new("kernel_wait", 0x1a..0x20, what);
            assert_eq!(Gap::parse("kernel_wait", &gap.within_function()), Some(gap));
        }
        for wrong in ["", "0x1a..0x20", "0x1a never executed", "1a..20 never executed", "0x1..0x2 seldom"] {
            assert_eq!(Gap::parse("kernel_wait", wrong), None, "{wrong}");
        }
    }
}
