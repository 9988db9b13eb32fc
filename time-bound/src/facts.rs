//! What is known of a program's loops and calls: each with its note.

use std::collections::{BTreeMap, BTreeSet};

use stack_bound::Image;
use stack_bound::flow::{Flow, Place};

use crate::nest::{self, Loop};
use crate::notes::{Noted, Notes, Turns};
use crate::problem::Problem;

/// A loop by the address of its header, with those inside of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Shape(BTreeMap<u32, Shape>);

impl Shape {
    fn add(&mut self, found: &Loop<Place>) {
        let inner = self.0.entry(found.header.0).or_default();
        found.inner.iter().for_each(|one| inner.add(one));
    }

    fn headers(&self) -> Vec<u32> {
        self.0.iter().flat_map(|(&header, inner)| [vec![header], inner.headers()].concat()).collect()
    }

    /// As notes have it, with a question mark for each loop.
    fn text(&self) -> String {
        let one = |inner: &Shape| {
            let brackets = if inner.0.is_empty() { String::new() } else { format!("({})", inner.text()) };
            format!("?{brackets}")
        };
        self.0.values().map(one).collect::<Vec<_>>().join(" ")
    }

    /// Gives each loop its note. `None` if they do not fit.
    fn note(&self, notes: &[Noted], turns: &mut BTreeMap<u32, Turns>) -> Option<()> {
        if self.0.len() != notes.len() {
            return None;
        }
        for ((&header, inner), noted) in self.0.iter().zip(notes) {
            turns.insert(header, noted.turns);
            inner.note(&noted.inner, turns)?;
        }
        Some(())
    }
}

/// What is known of loops and calls.
#[derive(Default)]
pub struct Facts {
    /// By the address of a loop's header.
    pub turns: BTreeMap<u32, Turns>,
    /// By the function that calls: whom it calls, how often at most.
    pub calls: BTreeMap<u32, Vec<(u32, u64)>>,
    /// By a function's name, what is said of its loops where they have no bound.
    pub loops: BTreeMap<String, Problem>,
}

impl Facts {
    /// What `notes` tell of the functions `flows`.
    ///
    /// # Errors
    /// Notes that fit no loop and no call.
    pub fn new(image: &Image, notes: &Notes, flows: &BTreeMap<u32, Flow>) -> Result<Self, BTreeSet<Problem>> {
        let shapes = shapes(image, flows);
        let mut facts = Facts::default();
        let mut problems = BTreeSet::new();
        for (function, shape) in &shapes {
            let (function, headers, text) = (function.clone(), shape.headers(), shape.text());
            let noted = notes.loops.get(&function);
            if noted.is_some_and(|noted| shape.note(noted, &mut facts.turns).is_none()) {
                problems.insert(Problem::Misfit { function, headers, shape: text });
            } else {
                let problem = Problem::NotNoted { function: function.clone(), headers, shape: text };
                facts.loops.insert(function, problem);
            }
        }
        for function in notes.loops.keys().filter(|function| !shapes.contains_key(*function)) {
            problems.insert(Problem::NoLoop { function: function.clone() });
        }
        for (&(caller, callee), &most) in &notes.calls {
            let calls = flows
                .get(&caller)
                .is_some_and(|flow| flow.nodes.values().any(|node| node.calls.contains(&callee)));
            if calls {
                facts.calls.entry(caller).or_default().push((callee, most));
            } else {
                let [caller, callee] = [caller, callee].map(|entry| image.name(entry).to_owned());
                problems.insert(Problem::NoCall { caller, callee });
            }
        }
        if problems.is_empty() { Ok(facts) } else { Err(problems) }
    }
}

impl Facts {
    /// Where the functions begin that have jobs.
    pub fn with_jobs(&self, flows: &BTreeMap<u32, Flow>) -> Vec<u32> {
        let has_job =
            |flow: &Flow| flow.nodes.keys().any(|(address, _)| self.turns.get(address) == Some(&Turns::Job));
        flows.iter().filter(|(_, flow)| has_job(flow)).map(|(&entry, _)| entry).collect()
    }
}

/// The loops of each function, by its name. What several functions end with belongs to one of them.
fn shapes(image: &Image, flows: &BTreeMap<u32, Flow>) -> BTreeMap<String, Shape> {
    let mut shapes = BTreeMap::<String, Shape>::new();
    for flow in flows.values() {
        // Those that can be entered at two places are found where a bound is wanted.
        let nest = flow.entry.and_then(|entry| nest::of(flow, entry).ok());
        for one in nest.into_iter().flatten() {
            shapes.entry(image.name(one.header.0).to_owned()).or_default().add(&one);
        }
    }
    shapes
}
