//! How long functions take at most, without preemption.

use std::collections::{BTreeMap, BTreeSet};

use stack_bound::Image;
use stack_bound::flow::{Flow, Node, Place};

use crate::facts::Facts;
use crate::notes::Turns;
use crate::problem::Problem;
use crate::ways::{Longest, Ways};

/// Times functions. The end of a job cuts their paths.
pub struct Timer<'a> {
    image: &'a Image,
    flows: &'a BTreeMap<u32, Flow>,
    facts: &'a Facts,
    known: BTreeMap<u32, Result<Longest, BTreeSet<Problem>>>,
    /// The jobs of the functions requested so far: how long each takes, by the address where it begins.
    pub jobs: BTreeMap<u32, u64>,
    /// The addresses where jobs begin within a function or its callees, by the function's start.
    begins: BTreeMap<u32, BTreeSet<u32>>,
}

impl<'a> Timer<'a> {
    /// A timer for an image's functions. `facts` has their loops and calls.
    pub fn new(image: &'a Image, flows: &'a BTreeMap<u32, Flow>, facts: &'a Facts) -> Self {
        Timer { image, flows, facts, known: BTreeMap::new(), jobs: BTreeMap::new(), begins: BTreeMap::new() }
    }

    /// The longest paths through the function that begins at `entry`.
    ///
    /// # Errors
    /// Each problem that keeps it from having a bound.
    pub fn function(&mut self, entry: u32) -> Result<Longest, BTreeSet<Problem>> {
        if let Some(known) = self.known.get(&entry) {
            return known.clone();
        }
        let flows = self.flows;
        let not_followed = || Problem::NotFollowed { function: self.image.name(entry).to_owned() };
        let longest = match flows.get(&entry).and_then(|flow| Some((flow, flow.entry?))) {
            Some((flow, begin)) => self.flow(flow, begin),
            None => Err([not_followed()].into()),
        };
        self.known.insert(entry, longest.clone());
        longest
    }

    fn flow(&mut self, flow: &Flow, entry: Place) -> Result<Longest, BTreeSet<Problem>> {
        let mut ways = Ways::default();
        let mut problems = BTreeSet::new();
        ways.enter((entry, false));
        for (&place, node) in &flow.nodes {
            problems.extend(self.add(place, node, &mut ways).err().into_iter().flatten());
        }
        problems.extend(ways.bound(self.image, flow, self.facts).err().into_iter().flatten());
        if !problems.is_empty() {
            return Err(problems);
        }
        let no_path = |_| [Problem::NoPath { function: self.image.name(entry.0).to_owned() }].into();
        for (place, cycles) in ways.by_begin().map_err(no_path)? {
            self.add_job(entry.0, flow, place, cycles);
        }
        ways.longest().map_err(no_path)
    }

    /// Adds a job of a function that begins at `entry`. A job that continues after a call has begun in the
    /// callee.
    fn add_job(&mut self, entry: u32, flow: &Flow, place: u32, cycles: u64) {
        let begins = if self.facts.turns.get(&place) == Some(&Turns::Job) {
            BTreeSet::from([place])
        } else {
            let calls = flow.nodes.iter().filter(|(at, _)| at.0 == place).flat_map(|(_, node)| &node.calls);
            calls.filter_map(|callee| self.begins.get(callee)).flatten().copied().collect()
        };
        for &begin in &begins {
            let known = self.jobs.entry(begin).or_default();
            *known = cycles.max(*known);
        }
        self.begins.entry(entry).or_default().extend(begins);
    }

    /// Adds an instruction, with the functions that it calls.
    fn add(&mut self, place: Place, node: &Node, ways: &mut Ways) -> Result<(), BTreeSet<Problem>> {
        let address = place.0;
        if self.facts.avoided.has(address, node) {
            return Ok(());
        }
        let no_time = || Problem::NoTime { function: self.image.name(address).to_owned(), address };
        let cycles = u64::from(node.cycles.ok_or_else(|| BTreeSet::from([no_time()]))?);
        let called = node.calls.iter().map(|&callee| self.function(callee));
        let called = called.collect::<Result<Vec<_>, _>>()?.into_iter().reduce(Longest::max);
        if self.facts.turns.get(&address) == Some(&Turns::Job) {
            // The job ends before this instruction, which is the first of the next job.
            ways.end(place, 0);
            let whole = match called {
                None => Some(0),
                Some(called) if called.into.is_none() => called.whole,
                Some(_) => {
                    let function = self.image.name(address).to_owned();
                    return Err([Problem::JobInJob { function, address }].into());
                }
            };
            if let Some(whole) = whole {
                ways.begin(place, cycles + whole, node);
            }
        } else if let Some(called) = called {
            ways.add_inside(called.between);
            if let Some(whole) = called.whole {
                ways.go_on((place, false), cycles + whole, node);
            }
            if let Some(into) = called.into {
                ways.end(place, cycles + into);
            }
            if let Some(out_of) = called.out_of {
                ways.begin(place, out_of, node);
            }
        } else {
            ways.go_on((place, false), cycles, node);
        }
        Ok(())
    }
}
