//! Which tasks run, and which of them a call is killing. A caller that starts a killed task frees its stack
//! first, but only once the call that kills it is over.

use core::sync::atomic::AtomicBool;
use core::sync::atomic::Ordering::Relaxed;

use crate::call::Outcome;
use crate::world::TASKS;

/// Only the running task or interrupt changes it. An interrupt leaves the entries of other tasks alone.
#[derive(Default)]
pub struct Lives {
    /// The tasks that run, or ran until a call that is not over yet.
    started: Tasks,
    /// The tasks that are being killed by calls that are not over yet.
    dying: Tasks,
}

#[derive(Default)]
struct Tasks([AtomicBool; TASKS]);

impl Tasks {
    const fn none() -> Self {
        Tasks([const { AtomicBool::new(false) }; TASKS])
    }

    fn has(&self, id: usize) -> bool {
        self.0.get(id).is_some_and(|is_in| is_in.load(Relaxed))
    }

    fn set(&self, id: usize, is_in: bool) {
        if let Some(slot) = self.0.get(id) {
            slot.store(is_in, Relaxed);
        }
    }
}

impl Lives {
    /// No task runs.
    pub const fn new() -> Self {
        Lives { started: Tasks::none(), dying: Tasks::none() }
    }

    /// Task `id` was started.
    #[inline(never)]
    pub fn begin(&self, id: usize) {
        self.started.set(id, true);
    }

    /// Task `id` ends itself.
    #[inline(never)]
    pub fn end(&self, id: usize) {
        self.started.set(id, false);
    }

    /// Whether a call that is not over yet kills task `id`.
    #[inline(never)]
    pub fn is_dying(&self, id: usize) -> bool {
        self.dying.has(id)
    }

    /// Makes a call that kills another task, `id`.
    #[inline(always)]
    pub fn killing(&self, id: usize, call: impl FnOnce() -> Outcome) -> Outcome {
        let was_dying = self.begin_to_kill(id);
        self.end_to_kill(id, was_dying, call())
    }

    /// Makes a call by which task `id` kills itself. The call returns only if it is refused.
    #[inline(always)]
    pub fn ending(&self, id: usize, call: impl FnOnce() -> Outcome) -> Outcome {
        self.end(id);
        let outcome = call();
        self.begin(id);
        outcome
    }

    /// Returns whether another call was killing it.
    #[inline(never)]
    fn begin_to_kill(&self, id: usize) -> bool {
        let was_dying = self.dying.has(id);
        self.dying.set(id, self.started.has(id));
        was_dying
    }

    #[inline(never)]
    fn end_to_kill(&self, id: usize, was_dying: bool, outcome: Outcome) -> Outcome {
        self.dying.set(id, was_dying);
        if outcome == Outcome::Nothing {
            self.end(id);
        }
        outcome
    }
}
