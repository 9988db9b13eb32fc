//! A program's loops and calls, each with its note.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::rc::Rc;

use stack_bound::flow::{Flow, Node, Place};
use stack_bound::{Annotations, Found, Image, flows};

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

    /// The shape in the syntax of notes, with a question mark for each loop.
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

/// The notes about loops and calls, and the code that no path passes.
#[derive(Clone, Default)]
pub struct Facts {
    /// By the address of a loop's header.
    pub turns: BTreeMap<u32, Turns>,
    /// By the caller: how often at most it calls each callee.
    pub calls: BTreeMap<u32, BTreeMap<u32, u64>>,
    /// By a function's name, the problem to report if its loops have no bound.
    pub loops: BTreeMap<String, Problem>,
    /// Functions and variables that paths avoid.
    pub avoided: Avoided,
    shapes: Rc<BTreeMap<String, Shape>>,
}

/// The functions and variables that paths avoid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Avoided {
    /// The start addresses of functions.
    pub functions: BTreeSet<u32>,
    /// Address ranges in the data space.
    pub places: Vec<Range<u16>>,
}

impl Avoided {
    /// Whether paths avoid the instruction at an address. The address itself is checked because a jump also
    /// leads into a function.
    pub fn has(&self, address: u32, node: &Node) -> bool {
        self.functions.contains(&address)
            || !node.calls.is_empty() && node.calls.iter().all(|callee| self.functions.contains(callee))
            || node.names.is_some_and(|named| self.places.iter().any(|place| place.contains(&named)))
    }
}

/// The control flow of an image, for interrupts that find a task's stack or the kernel's, and the notes about
/// it.
pub struct View {
    /// By where functions begin.
    pub flows: BTreeMap<u32, Flow>,
    pub facts: Facts,
}

impl View {
    /// The view of an image's code for interrupts that find the stack `found`.
    ///
    /// # Errors
    /// Code that can't be followed, and notes that do not fit.
    pub fn new(
        image: &Image,
        annotations: &Annotations,
        notes: &Notes,
        found: Found,
    ) -> Result<Self, Vec<Problem>> {
        let followed = flows(image, annotations, found);
        let flows =
            followed.map_err(|problems| problems.into_iter().map(Problem::Flow).collect::<Vec<_>>())?;
        let facts = Facts::new(image, notes, &flows).map_err(Vec::from_iter)?;
        Ok(View { flows, facts })
    }
}

impl Facts {
    /// The facts that `notes` state about the functions `flows`.
    ///
    /// # Errors
    /// Notes that fit no loop and no call.
    fn new(image: &Image, notes: &Notes, flows: &BTreeMap<u32, Flow>) -> Result<Self, BTreeSet<Problem>> {
        let shapes = Rc::new(shapes(image, flows));
        let mut facts = Facts { shapes: shapes.clone(), ..Facts::default() };
        for (function, shape) in shapes.iter() {
            let (function, headers, shape) = (function.clone(), shape.headers(), shape.text());
            facts.loops.insert(function.clone(), Problem::NotNoted { function, headers, shape });
        }
        facts.add(image, notes, flows)?;
        Ok(facts)
    }

    /// Adds the facts of `notes`. They replace earlier ones about the same loops and calls.
    ///
    /// # Errors
    /// Notes that fit no loop and no call.
    pub fn add(
        &mut self,
        image: &Image,
        notes: &Notes,
        flows: &BTreeMap<u32, Flow>,
    ) -> Result<(), BTreeSet<Problem>> {
        let (shapes, facts) = (self.shapes.clone(), self);
        let mut problems = BTreeSet::new();
        for (function, noted) in &notes.loops {
            let function = function.clone();
            match shapes.get(&function) {
                None => problems.insert(Problem::NoLoop { function }),
                Some(shape) if shape.note(noted, &mut facts.turns).is_none() => problems
                    .insert(Problem::Misfit { function, headers: shape.headers(), shape: shape.text() }),
                Some(_) => true,
            };
        }
        for (&(caller, callee), &most) in &notes.calls {
            let calls = flows
                .get(&caller)
                .is_some_and(|flow| flow.nodes.values().any(|node| node.calls.contains(&callee)));
            if calls {
                facts.calls.entry(caller).or_default().insert(callee, most);
            } else {
                let [caller, callee] = [caller, callee].map(|entry| image.name(entry).to_owned());
                problems.insert(Problem::NoCall { caller, callee });
            }
        }
        if problems.is_empty() { Ok(()) } else { Err(problems) }
    }
}

impl Facts {
    /// The start addresses of the functions that have jobs.
    pub fn with_jobs(&self, flows: &BTreeMap<u32, Flow>) -> Vec<u32> {
        let has_job =
            |flow: &Flow| flow.nodes.keys().any(|(address, _)| self.turns.get(address) == Some(&Turns::Job));
        flows.iter().filter(|(_, flow)| has_job(flow)).map(|(&entry, _)| entry).collect()
    }
}

/// The loops of each function, by its name. A tail that several functions share belongs to one of them.
fn shapes(image: &Image, flows: &BTreeMap<u32, Flow>) -> BTreeMap<String, Shape> {
    let mut shapes = BTreeMap::<String, Shape>::new();
    for flow in flows.values() {
        // A loop that can be entered at two places is reported where a bound is computed.
        let nest = flow.entry.and_then(|entry| nest::of(flow, entry).ok());
        for one in nest.into_iter().flatten() {
            shapes.entry(image.name(one.header.0).to_owned()).or_default().add(&one);
        }
    }
    shapes
}
