//! Critical sections that end early: interrupts are enabled before SREG is restored.
//!
//! Such a section reads SREG, masks interrupts, and writes back what it has read: that of
//! `avr_device::interrupt::free`, of the crate `critical-section`, or of avr-libc's `ATOMIC_RESTORESTATE`. A
//! task's calls of the kernel begin with `cli` alone and end with `sei`: one within such a section ends it. A
//! function that ends its caller's section by `sei` alone would be taken for such a call.

use std::collections::{BTreeMap, BTreeSet};

use crate::enables::enables_interrupts;
use crate::flow::{Flow, Masking, Node};
use crate::problem::Problem;
use crate::{Annotations, Image};

/// Sections beyond so many are not counted: a loop may begin one each turn.
const MOST: i8 = 8;

/// What is known at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct At {
    /// The sections that the function has begun and not ended; negative where it has ended its caller's.
    open: i8,
    /// Whether SREG was read, and interrupts are not masked yet.
    is_read: bool,
    /// Whether interrupts were masked within a section, without reading SREG.
    is_masked_again: bool,
}

impl At {
    /// After the end of the innermost section.
    fn ended(self) -> Self {
        At { open: (self.open - 1).max(-MOST), ..At::default() }
    }
}

/// Finds the sections.
pub struct Sections<'a> {
    image: &'a Image,
    annotations: &'a Annotations,
    flows: &'a BTreeMap<u32, Flow>,
    /// By a function's start: the sections that it leaves open.
    left_open: BTreeMap<u32, i8>,
    problems: BTreeSet<Problem>,
}

impl<'a> Sections<'a> {
    /// The sections that end early in the functions of a program.
    pub fn that_end_early(
        image: &'a Image,
        annotations: &'a Annotations,
        flows: &'a BTreeMap<u32, Flow>,
    ) -> BTreeSet<Problem> {
        let mut sections =
            Sections { image, annotations, flows, left_open: BTreeMap::new(), problems: BTreeSet::new() };
        for &entry in flows.keys() {
            sections.function(entry);
        }
        sections.problems
    }

    /// Follows a function. Returns how many sections it leaves open, a negative number where it ends its
    /// caller's.
    fn function(&mut self, entry: u32) -> i8 {
        if let Some(&known) = self.left_open.get(&entry) {
            return known;
        }
        self.left_open.insert(entry, 0); // for a function that calls itself
        let flows = self.flows;
        let Some((flow, begin)) = flows.get(&entry).and_then(|flow| Some((flow, flow.entry?))) else {
            return 0;
        };
        let mut left_open = None;
        let mut seen = BTreeSet::new();
        let mut due = vec![(begin, At::default())];
        while let Some((place, at)) = due.pop() {
            let Some(node) = flow.nodes.get(&place).filter(|_| seen.insert((place, at))) else { continue };
            let after = self.after(place.0, node, at);
            if node.next.is_empty() && node.wakes.is_none() {
                left_open = left_open.max(Some(after.open));
            }
            // A section may also end by `sei`, which is skipped where interrupts were masked before it.
            let enables = |to| flow.nodes.get(to).is_some_and(|next| next.masking == Masking::Enables);
            let may_end = after.open > 0 && !after.is_masked_again && node.next.len() > 1;
            let ends = may_end && node.next.iter().any(|(to, _)| enables(to));
            let after = if ends { after.ended() } else { after };
            due.extend(node.next.iter().map(|(to, _)| to).chain(&node.wakes).map(|to| (*to, after)));
        }
        let left_open = left_open.unwrap_or(0);
        self.left_open.insert(entry, left_open);
        left_open
    }

    /// What is known after an instruction and the functions that it calls.
    fn after(&mut self, address: u32, node: &Node, mut at: At) -> At {
        let is_open = at.open > 0;
        if let Some(left_open) = node.calls.iter().map(|&callee| self.function(callee)).max() {
            let enables = |&&callee: &&u32| enables_interrupts(self.image, self.annotations, callee);
            if is_open && let Some(&callee) = node.calls.iter().find(enables) {
                self.ends_early(address, self.image.name(callee));
            }
            at.open = (at.open + left_open).clamp(-MOST, MOST);
            at.is_read = false;
            return at;
        }
        match node.masking {
            Masking::Nothing => at,
            Masking::Reads(_) => At { is_read: true, ..at },
            Masking::Masks if at.is_read => At { open: (at.open + 1).min(MOST), is_read: false, ..at },
            Masking::Masks => At { is_masked_again: is_open, ..at },
            Masking::Enables => {
                if is_open {
                    self.ends_early(address, "sei");
                }
                At::default()
            }
            Masking::Restores(_) => at.ended(),
        }
    }

    fn ends_early(&mut self, address: u32, by: &str) {
        let [function, by] = [self.image.name(address), by].map(str::to_owned);
        self.problems.insert(Problem::SectionEnded { function, address, by });
    }
}
