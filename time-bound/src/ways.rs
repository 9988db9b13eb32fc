//! The paths through a function: from its start to its return, and to and from the cuts between them.

use std::collections::{BTreeMap, BTreeSet};

use stack_bound::Image;
use stack_bound::flow::{Flow, Node, Place};

use crate::facts::Facts;
use crate::nest;
use crate::notes::Turns;
use crate::paths::{Bounded, Paths};
use crate::problem::Problem;

/// The longest paths through a function and its callees, in cycles. A cut is where one job ends and the next
/// begins, or where interrupts are enabled and masked again. `None` if there is no such path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Longest {
    /// From its start to its return, or to where the program never continues.
    pub whole: Option<u64>,
    /// From its start to a cut.
    pub into: Option<u64>,
    /// From a cut to its return.
    pub out_of: Option<u64>,
    /// From a cut to the next.
    pub between: Option<u64>,
}

impl Longest {
    /// The longer of two, path by path.
    pub fn max(self, other: Longest) -> Longest {
        Longest {
            whole: self.whole.max(other.whole),
            into: self.into.max(other.into),
            out_of: self.out_of.max(other.out_of),
            between: self.between.max(other.between),
        }
    }
}

/// A place before a cut, or after it.
pub type Point = (Place, bool);

/// The paths through a function.
#[derive(Default)]
pub struct Ways {
    paths: Paths<Point>,
    /// Where the function begins.
    entry: BTreeMap<Point, u64>,
    /// Where the function returns, and the cycles of the instruction there.
    returns: BTreeMap<Point, u64>,
    /// Where paths end at cuts, and the cycles of the instruction there up to the cut.
    ends: BTreeMap<Point, u64>,
    /// Where paths begin after cuts, and the cycles before that.
    begins: BTreeMap<Point, u64>,
    /// The longest path between two cuts within calls.
    inside: Option<u64>,
}

impl Ways {
    /// Notes that the function begins there.
    pub fn enter(&mut self, point: Point) {
        self.entry.insert(point, 0);
    }

    /// Continues a path from a place, which takes `cycles`, to the places that follow it, or to the return.
    pub fn go_on(&mut self, (place, cut): Point, cycles: u64, node: &Node) {
        let next = node.next.iter();
        let edges = next.map(|&(to, more)| ((place, cut), (to, false), cycles + u64::from(more)));
        self.paths.edges.extend(edges);
        if node.next.is_empty() {
            self.returns.insert((place, cut), cycles);
        }
    }

    /// Ends a path at a place, `cycles` after it is reached.
    pub fn end(&mut self, place: Place, cycles: u64) {
        self.ends.insert((place, false), cycles);
    }

    /// Begins a path at a place, which takes `cycles` from the cut on.
    pub fn begin(&mut self, place: Place, cycles: u64, node: &Node) {
        self.begins.insert((place, true), 0);
        self.go_on((place, true), cycles, node);
    }

    /// Notes paths between cuts within a call.
    pub fn add_inside(&mut self, between: Option<u64>) {
        self.inside = self.inside.max(between);
    }

    /// Bounds the paths by the notes about the function's loops and calls.
    ///
    /// # Errors
    /// Loops on these paths without a note.
    pub fn bound(&mut self, image: &Image, flow: &Flow, facts: &Facts) -> Result<(), BTreeSet<Problem>> {
        let Some(entry) = flow.entry else { return Ok(()) };
        let mut problems = BTreeSet::new();
        let name = |address| image.name(address).to_owned();
        let mut due = nest::of(flow, entry).map_err(|(address, _)| {
            BTreeSet::from([Problem::Irreducible { function: name(address), address }])
        })?;
        while let Some(one) = due.pop() {
            let (header, address) = ((one.header, false), one.header.0);
            let nodes = one.nodes.iter().flat_map(|&place| [(place, false), (place, true)]).collect();
            if self.paths.is_cycle(header, &nodes) {
                match facts.turns.get(&address) {
                    Some(&Turns::AtMost(turns)) => self.paths.loops.push(Bounded { header, nodes, turns }),
                    Some(&Turns::InAll(turns)) => self.paths.limits.push(([header].into(), turns)),
                    Some(Turns::Job) | None => problems.extend(facts.loops.get(&name(address)).cloned()),
                }
            }
            due.extend(one.inner);
        }
        for (callee, most) in facts.calls.get(&entry.0).into_iter().flatten() {
            let calls = flow.nodes.iter().filter(|(_, node)| node.calls.contains(callee));
            let points = calls.flat_map(|(&place, _)| [(place, false), (place, true)]);
            self.paths.limits.push((points.collect(), *most));
        }
        if problems.is_empty() { Ok(()) } else { Err(problems) }
    }

    /// The longest path from each cut in the function itself to the next, by the cut's address.
    ///
    /// # Errors
    /// The notes about loops and calls leave no path.
    pub fn by_begin(&self) -> Result<BTreeMap<u32, u64>, microlp::Error> {
        let mut longest = BTreeMap::new();
        for (&begin, &before) in &self.begins {
            let way = self.paths.longest(&[(begin, before)].into(), &self.ends)?;
            longest.extend(way.map(|way| (begin.0.0, way)));
        }
        Ok(longest)
    }

    /// The longest paths of each kind.
    ///
    /// # Errors
    /// The notes about loops and calls leave no path.
    pub fn longest(&self) -> Result<Longest, microlp::Error> {
        let Ways { paths, entry, returns, ends, begins, inside } = self;
        Ok(Longest {
            whole: paths.longest(entry, returns)?,
            into: paths.longest(entry, ends)?,
            out_of: paths.longest(begins, returns)?,
            between: paths.longest(begins, ends)?.max(*inside),
        })
    }
}
