//! How much of a stack is used, and by which functions.

use std::collections::BTreeMap;

use crate::Step;

/// The most that is used of a stack, by function, from the top down.
#[derive(Clone, Default)]
pub struct Use(pub Vec<Step>);

impl Use {
    pub fn of(name: &str, bytes: u32) -> Self {
        Use(vec![Step { name: name.to_owned(), bytes }])
    }

    pub fn bytes(&self) -> u32 {
        self.0.iter().map(|step| step.bytes).sum()
    }

    /// This use with another one on top of it.
    pub fn then(&self, other: &Use) -> Self {
        Use(self.0.iter().chain(&other.0).cloned().collect())
    }

    pub fn raise_to(&mut self, other: &Use) {
        if other.bytes() > self.bytes() {
            self.clone_from(other);
        }
    }
}

/// Where interrupts are enabled: a number of the vector, if it is in a handler, and the start of the
/// function. Functions of two files may have one name.
type Window = (Option<usize>, u32);

/// The use of a stack, and where interrupts come on top of it.
#[derive(Clone, Default)]
pub struct Usage {
    pub deepest: Use,
    /// The most that is in use while interrupts are enabled.
    windows: BTreeMap<Window, Use>,
}

impl Usage {
    pub fn only(deepest: Use) -> Self {
        Usage { deepest, windows: BTreeMap::new() }
    }

    /// Notes that interrupts are enabled there with so much in use.
    pub fn open_window(&mut self, window: Window, within: Use) {
        self.windows.entry(window).or_default().raise_to(&within);
    }

    /// The use by the handler of an interrupt.
    pub fn of_handler(&self, vector: usize) -> Usage {
        let windows = self.windows.iter();
        let windows = windows.map(|(&(_, function), within)| ((Some(vector), function), within.clone()));
        Usage { deepest: self.deepest.clone(), windows: windows.collect() }
    }

    pub fn raise_to(&mut self, other: &Usage) {
        self.deepest.raise_to(&other.deepest);
        for (&window, within) in &other.windows {
            self.open_window(window, within.clone());
        }
    }

    /// Raises this to `other` on top of `bytes` that `name` uses.
    pub fn raise_to_call(&mut self, name: &str, bytes: u32, other: &Usage) {
        // Names are long, and most places are not the deepest.
        if bytes + other.deepest.bytes() > self.deepest.bytes() {
            self.deepest = Use::of(name, bytes).then(&other.deepest);
        }
        for (&window, within) in &other.windows {
            self.open_window(window, Use::of(name, bytes).then(within));
        }
    }

    /// The most that is used with interrupts, each of which uses `interrupts` at most.
    pub fn with(&self, interrupts: &Usage) -> Use {
        let mut deepest = self.deepest.clone();
        for (&window, within) in &self.windows {
            deepest.raise_to(&within.then(&interrupts.nested(|other| other != window)));
        }
        deepest
    }

    /// The use of interrupts that nest in one another: each window opens once, and the deepest interrupt
    /// occurs in the last one.
    pub fn nested(&self, is_open: impl Fn(Window) -> bool) -> Use {
        let open = self.windows.iter().filter(|&(&window, _)| is_open(window));
        open.fold(Use::default(), |nested, (_, within)| nested.then(within)).then(&self.deepest)
    }
}
