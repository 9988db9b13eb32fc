//! What lasts, one after the other.

/// Something that lasts.
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

/// Slices one after the other, of which the last may go on.
pub(super) struct Track<T> {
    slices: Vec<Slice<T>>,
    open: Option<(u64, T)>,
}

impl<T: PartialEq> Track<T> {
    pub fn new() -> Self {
        Self { slices: Vec::new(), open: None }
    }

    /// What goes on.
    pub fn now(&self) -> Option<&T> {
        self.open.as_ref().map(|(_, what)| what)
    }

    /// Goes on with `what` from `cycle` on, or from where the last slice began if that is later.
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
