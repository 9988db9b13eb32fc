//! The notes about a program by address, so that a run of the program can be held against them.

use std::collections::{BTreeMap, BTreeSet};

use stack_bound::flow::{Flow, Place};
use stack_bound::{Annotations, Found, Image};

use crate::facts::View;
use crate::nest::{self, Loop};
use crate::notes::{Notes, Turns};
use crate::problem::Problem;

/// How often instructions are executed at most, by a note. Addresses are in flash, in bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limit {
    /// The function that has the loop, or `A -> B` for calls.
    pub name: String,
    /// The first instruction of the loop, or those that call.
    pub counted: BTreeSet<u32>,
    /// How often these are executed at most, all together, between two executions of instructions in
    /// `begins`.
    pub most: u64,
    /// The instructions from which the loop may be entered. Of calls, and of a loop with a total, the first
    /// one of the function. Where jobs begin the count begins, too.
    pub begins: BTreeSet<u32>,
}

/// What the notes about an image say of its loops, by address, then of its calls. Main loops of tasks have no
/// limit, and are left out.
///
/// # Errors
/// Code that can't be followed, and notes that do not fit.
pub fn limits(image: &Image, annotations: &Annotations, notes: &Notes) -> Result<Vec<Limit>, Vec<Problem>> {
    let View { flows, facts } = View::new(image, annotations, notes, Found::Task)?;
    let is_job = |(address, _): &&Place| facts.turns.get(address) == Some(&Turns::Job);
    let called_by = |entry| flows.values().flat_map(move |caller| calls(caller, entry));
    let whole = |flow: &Flow, entry| -> BTreeSet<u32> {
        addresses(flow.nodes.keys().filter(is_job)).chain([entry]).collect()
    };
    let mut loops = BTreeMap::<u32, Limit>::new();
    for flow in flows.values() {
        let Some(entry) = flow.entry else { continue };
        for one in all(nest::of(flow, entry).unwrap_or_default()) {
            let header = one.header.0;
            let (most, begins) = match facts.turns.get(&header) {
                Some(&Turns::AtMost(most)) => {
                    let mut begins = enter(flow, &one);
                    begins.extend(called_by(entry.0).filter(|_| header == entry.0));
                    begins.extend(addresses(one.nodes.iter().filter(is_job)));
                    (most, begins)
                }
                Some(&Turns::InAll(most)) => (most, whole(flow, entry.0)),
                Some(Turns::Job) | None => continue,
            };
            let name = image.name(header).to_owned();
            let new = || Limit { name, counted: [header].into(), most, begins: BTreeSet::new() };
            // Several functions may share a tail, and a function may reach it with several stack pointers.
            loops.entry(header).or_insert_with(new).begins.extend(begins);
        }
    }
    let noted = facts.calls.iter().flat_map(|(caller, noted)| noted.iter().map(move |noted| (caller, noted)));
    let calls = noted.filter_map(|(&caller, (&callee, &most))| {
        let flow = flows.get(&caller)?;
        let name = format!("{} -> {}", image.name(caller), image.name(callee));
        Some(Limit { name, counted: calls(flow, callee).collect(), most, begins: whole(flow, caller) })
    });
    let calls: Vec<_> = calls.collect();
    Ok(loops.into_values().chain(calls).collect())
}

/// The addresses at which a function calls the one that begins at `callee`.
fn calls(caller: &Flow, callee: u32) -> impl Iterator<Item = u32> {
    let calls = caller.nodes.iter().filter(move |(_, node)| node.calls.contains(&callee));
    addresses(calls.map(|(place, _)| place))
}

/// The addresses of the instructions outside of a loop that may be followed by its first one.
fn enter(flow: &Flow, one: &Loop<Place>) -> BTreeSet<u32> {
    let outside = flow.nodes.iter().filter(|(place, _)| !one.nodes.contains(place));
    let enter = outside.filter(|(_, node)| {
        let mut follow = node.next.iter().map(|(place, _)| place).chain(&node.wakes);
        follow.any(|place| *place == one.header)
    });
    addresses(enter.map(|(place, _)| place)).collect()
}

/// These loops and those inside of them.
fn all(loops: Vec<Loop<Place>>) -> Vec<Loop<Place>> {
    let with_inner = |one: Loop<Place>| [vec![one.clone()], all(one.inner)].concat();
    loops.into_iter().flat_map(with_inner).collect()
}

fn addresses<'a>(places: impl Iterator<Item = &'a Place>) -> impl Iterator<Item = u32> {
    places.map(|&(address, _)| address)
}
