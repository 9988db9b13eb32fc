//! How long interrupts are masked at a stretch, at most.

use std::collections::{BTreeMap, BTreeSet};

use stack_bound::Image;
use stack_bound::flow::{Flow, Masking, Node, Place};

use crate::facts::Facts;
use crate::problem::Problem;
use crate::ways::{Longest, Ways};

/// How long a function masks interrupts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stretches {
    /// Paths with interrupts masked. A cut is where interrupts are enabled and masked again. `reti` is no
    /// cut: such a path ends at the return.
    pub longest: Longest,
    /// Whether it may return with interrupts enabled, and whether with them masked.
    returns: [bool; 2],
    /// Whether it returns by `reti`. Then the next instruction of its caller runs before any interrupt.
    is_handler: bool,
}

/// Whether interrupts are masked.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Mode {
    Enabled,
    Masked,
    /// They are masked, and already were when SREG was read into this register.
    Nested(u8),
}

/// Finds the stretches.
pub struct Stretcher<'a> {
    image: &'a Image,
    flows: &'a BTreeMap<u32, Flow>,
    facts: &'a Facts,
    /// By a function's start, and whether interrupts are masked there.
    known: BTreeMap<(u32, bool), Result<Stretches, BTreeSet<Problem>>>,
}

impl<'a> Stretcher<'a> {
    /// A stretcher for an image's functions. `facts` has their loops and calls.
    pub fn new(image: &'a Image, flows: &'a BTreeMap<u32, Flow>, facts: &'a Facts) -> Self {
        Stretcher { image, flows, facts, known: BTreeMap::new() }
    }

    /// The stretches of the function that begins at `entry`, called with interrupts masked or enabled.
    ///
    /// # Errors
    /// Each problem that keeps it from having a bound.
    pub fn function(&mut self, entry: u32, is_masked: bool) -> Result<Stretches, BTreeSet<Problem>> {
        if let Some(known) = self.known.get(&(entry, is_masked)) {
            return known.clone();
        }
        let flows = self.flows;
        let not_followed = || Problem::NotFollowed { function: self.image.name(entry).to_owned() };
        let found = match flows.get(&entry).and_then(|flow| Some((flow, flow.entry?))) {
            Some((flow, begin)) => self.flow(flow, begin, is_masked),
            None => Err([not_followed()].into()),
        };
        self.known.insert((entry, is_masked), found.clone());
        found
    }

    fn flow(
        &mut self,
        flow: &Flow,
        entry: Place,
        begins_masked: bool,
    ) -> Result<Stretches, BTreeSet<Problem>> {
        let mut ways = Ways::default();
        if begins_masked {
            ways.enter((entry, false));
        }
        let mut returns = [false; 2];
        let mut is_handler = false;
        let mut seen = BTreeSet::new();
        let begins = if begins_masked { Mode::Masked } else { Mode::Enabled };
        let mut due = vec![(entry, begins)];
        while let Some((place, mode)) = due.pop() {
            let Some(node) = flow.nodes.get(&place).filter(|_| seen.insert((place, mode))) else {
                continue;
            };
            is_handler |= is_return_from_interrupt(node);
            for after in self.add(place, node, mode, begins, flow, &mut ways)? {
                returns[usize::from(after != Mode::Enabled)] |= node.next.is_empty();
                due.extend(node.next.iter().map(|&(to, _)| (to, after)));
                // Only an interrupt that is enabled ends a sleep.
                due.extend(node.wakes.filter(|_| after == Mode::Enabled).map(|to| (to, after)));
            }
        }
        ways.bound(self.image, flow, self.facts)?;
        let no_path = |_| Problem::NoPath { function: self.image.name(entry.0).to_owned() };
        let longest = ways.longest().map_err(|error| BTreeSet::from([no_path(error)]))?;
        Ok(Stretches { longest, returns, is_handler })
    }

    /// Adds an instruction, with the functions that it calls. Returns the modes after it.
    fn add(
        &mut self,
        place: Place,
        node: &Node,
        mode: Mode,
        begins: Mode,
        flow: &Flow,
        ways: &mut Ways,
    ) -> Result<Vec<Mode>, BTreeSet<Problem>> {
        let is_masked = mode != Mode::Enabled;
        let problem = |problem: fn(String, u32) -> Problem| {
            BTreeSet::from([problem(self.image.name(place.0).to_owned(), place.0)])
        };
        let no_time = || problem(|function, address| Problem::NoTime { function, address });
        let cycles = u64::from(node.cycles.ok_or_else(no_time)?);
        let nested = || problem(|function, address| Problem::Nested { function, address });
        let mut called: Option<Stretches> = None;
        for &callee in &node.calls {
            let one = self.function(callee, is_masked)?;
            let both = |other: Stretches| Stretches {
                longest: one.longest.max(other.longest),
                returns: [0, 1].map(|mode| one.returns[mode] || other.returns[mode]),
                is_handler: one.is_handler || other.is_handler,
            };
            called = Some(called.map_or(one, both));
        }
        // An interrupt comes only once the next instruction has run. If that one masks interrupts again, none
        // comes.
        let masks = |to: &Place| flow.nodes.get(to).is_some_and(|next| next.masking == Masking::Masks);
        let is_in_vain = node.next.iter().any(|(to, _)| masks(to));
        let masked = if is_masked { mode } else { Mode::Masked };
        if let Some(Stretches { longest, is_handler: true, .. }) = called
            && !is_in_vain
        {
            ways.add_inside(longest.between.max(longest.out_of));
            if let Some(first) = longest.whole.max(longest.into).filter(|_| is_masked) {
                ways.end(place, cycles + first);
            }
            return Ok(vec![Mode::Enabled]);
        }
        if let Some(Stretches { longest, returns, is_handler }) = called {
            ways.add_inside(longest.between);
            if let Some(whole) = longest.whole.filter(|_| is_masked) {
                ways.go_on((place, false), cycles + whole, node);
            }
            if let Some(into) = longest.into.filter(|_| is_masked) {
                ways.end(place, cycles + into);
            }
            if let Some(out_of) = longest.out_of {
                ways.begin(place, out_of, node);
            }
            if is_handler {
                return Ok(vec![masked]); // by `reti` to what masks interrupts
            }
            let modes = [Mode::Enabled, masked].into_iter().zip(returns);
            return Ok(modes.filter(|(_, returns)| *returns).map(|(mode, _)| mode).collect());
        }
        let is_return_from_interrupt = is_return_from_interrupt(node);
        let after = match (node.masking, mode) {
            (Masking::Nothing, _) => mode,
            (Masking::Masks, Mode::Enabled) => Mode::Masked,
            (Masking::Masks, _) => mode,
            (Masking::Enables, _) if is_return_from_interrupt => mode,
            (Masking::Enables, _) => Mode::Enabled,
            // The first value that is read is the one with which the function began; a later one is restored
            // before it.
            (Masking::Reads(register), Mode::Masked) if begins == Mode::Enabled => Mode::Nested(register),
            (Masking::Reads(_), Mode::Nested(_)) => return Err(nested()),
            (Masking::Reads(_), _) => mode,
            (Masking::Restores(register), Mode::Nested(read)) if register == read => Mode::Masked,
            (Masking::Restores(_), Mode::Nested(_)) => return Err(nested()),
            (Masking::Restores(_), _) => begins,
        };
        let after = if after == Mode::Enabled && is_in_vain { mode } else { after };
        match (is_masked, after != Mode::Enabled) {
            (true, true) => ways.go_on((place, false), cycles, node),
            (true, false) => ways.end(place, cycles),
            (false, true) => ways.begin(place, 0, node),
            // `reti` with interrupts enabled counts as if it masked them, since an instruction follows it in
            // any case.
            (false, false) if is_return_from_interrupt => ways.begin(place, cycles, node),
            (false, false) => {}
        }
        Ok(vec![after])
    }
}

/// Whether a node is `reti`.
fn is_return_from_interrupt(node: &Node) -> bool {
    node.masking == Masking::Enables && node.next.is_empty()
}
