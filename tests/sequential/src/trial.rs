//! The behaviours that `./x bench concurrency` adds, as turns of the loop.

use board::debug::mark;
use board::delay;
use board::external::External;
use board::interrupts::Serves;
use kernel::{Context, Semaphore, Task, Ticks, is_reached, now};
use trial::{COMPUTES_EVERY, ELEVEN, PIECE, SEVEN, TRIAL_IS_CUT, TRIAL_LENGTH, compute};

/// Posted at each edge.
pub static EDGE: Semaphore = Semaphore::new(0);

/// When each of these behaviours is due.
pub struct Trial {
    seven: Ticks,
    eleven: Ticks,
    computes: Ticks,
    /// The pieces left, if computing is cut.
    left: u16,
}

impl Trial {
    /// The behaviours, from now on.
    pub fn new(task: &mut Task, external: External, vectors: impl Serves<External>) -> Self {
        external.start(vectors, task, &EDGE);
        let time = now(task);
        let [seven, eleven, computes] = [SEVEN, ELEVEN, COMPUTES_EVERY].map(|ticks| time.wrapping_add(ticks));
        Trial { seven, eleven, computes, left: 0 }
    }

    /// Takes a turn. `is_edge`: an edge has come. Returns the time of the next turn if no edge comes before.
    #[inline(never)] // its stack is needed here alone
    pub fn turn(&mut self, task: &mut Task, is_edge: bool) -> Option<Ticks> {
        if is_edge {
            mark(trial::mark::EDGE);
        }
        let time = now(task);
        if is_reached(self.seven, time) {
            self.seven = self.seven.wrapping_add(SEVEN);
            mark(trial::mark::SEVEN);
        }
        if is_reached(self.eleven, time) {
            self.eleven = self.eleven.wrapping_add(ELEVEN);
            mark(trial::mark::ELEVEN);
        }
        if self.left > 0 {
            self.go_on();
        } else if is_reached(self.computes, time) {
            self.computes = self.computes.wrapping_add(COMPUTES_EVERY);
            self.begin(task);
        }
        if self.left > 0 {
            return Some(time);
        }
        let first = |one, other| if is_reached(one, other) { one } else { other };
        Some(first(first(self.seven, self.eleven), self.computes))
    }

    fn begin(&mut self, task: &mut Task) {
        let (length, is_cut) = task.mask(|masked| (TRIAL_LENGTH.get(masked), TRIAL_IS_CUT.get(masked)));
        mark(trial::mark::BEGINS);
        if is_cut && length > 0 {
            self.left = length;
        } else {
            compute(length, delay::cycles::<PIECE>);
            mark(trial::mark::ENDS);
        }
    }

    /// Computes a piece.
    fn go_on(&mut self) {
        compute(1, delay::cycles::<PIECE>);
        self.left -= 1;
        if self.left == 0 {
            mark(trial::mark::ENDS);
        }
    }
}
