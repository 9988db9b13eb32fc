//! A sequence of states over time.

/// A state, or another thing that lasts, with its begin and end in cycles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slice<T> {
    pub begin: u64,
    pub end: u64,
    pub what: T,
}

impl<T> Slice<T> {
    /// How long it lasts, in cycles.
    pub fn cycles(&self) -> u64 {
        self.end - self.begin
    }
}

/// Slices one after the other. The last one may still be open.
pub(super) struct Track<T> {
    slices: Vec<Slice<T>>,
    open: Option<(u64, T)>,
}

impl<T: PartialEq> Track<T> {
    pub fn new() -> Self {
        Self { slices: Vec::new(), open: None }
    }

    /// The state of the open slice.
    pub fn now(&self) -> Option<&T> {
        self.open.as_ref().map(|(_, what)| what)
    }

    /// Changes to `what` at `cycle`, or at the begin of the open slice if that is later.
    pub fn turn(&mut self, cycle: u64, what: Option<T>) {
        if self.now() == what.as_ref() {
            return;
        }
        let begin = self.open.as_ref().map_or(cycle, |&(begin, _)| cycle.max(begin));
        if let Some((since, before)) = self.open.take()
            && since < begin
        {
            self.slices.push(Slice { begin: since, end: begin, what: before });
        }
        self.open = what.map(|what| (begin, what));
    }

    /// All slices, the last of which ends at `cycle`.
    pub fn finish(mut self, cycle: u64) -> Vec<Slice<T>> {
        self.turn(cycle, None);
        self.slices
    }
}
