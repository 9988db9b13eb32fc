//! What is known of a program's loops and calls: each with its note.

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

/// What is known of loops and calls, and where no way leads.
#[derive(Clone, Default)]
pub struct Facts {
    /// By the address of a loop's header.
    pub turns: BTreeMap<u32, Turns>,
    /// By the function that calls: whom it calls, how often at most.
    pub calls: BTreeMap<u32, BTreeMap<u32, u64>>,
    /// By a function's name, what is said of its loops where they have no bound.
    pub loops: BTreeMap<String, Problem>,
    /// What is not called, and not named by any instruction.
    pub avoided: Avoided,
    shapes: Rc<BTreeMap<String, Shape>>,
}

/// What the ways that are looked at pass by.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Avoided {
    /// Where functions begin.
    pub functions: BTreeSet<u32>,
    /// Places in the data space.
    pub places: Vec<Range<u16>>,
}

impl Avoided {
    /// Whether no way leads over the instruction at an address. One way into a function is a jump to it.
    pub fn has(&self, address: u32, node: &Node) -> bool {
        self.functions.contains(&address)
            || !node.calls.is_empty() && node.calls.iter().all(|callee| self.functions.contains(callee))
            || node.names.is_some_and(|named| self.places.iter().any(|place| place.contains(&named)))
    }
}

/// The control flow of an image, as its interrupts find a task's stack or the kernel's, and what is known of
/// it.
pub struct View {
    /// By where functions begin.
    pub flows: BTreeMap<u32, Flow>,
    pub facts: Facts,
}

impl View {
    /// Of an image's code, as its interrupts find such a stack.
    ///
    /// # Errors
    /// What can't be followed, and notes that do not fit.
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
    /// What `notes` tell of the functions `flows`.
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

    /// Adds what `notes` tell, in place of what was told of the same loops and calls.
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
