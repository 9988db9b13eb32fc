//! Goes back in time. Now and then the process that runs the robot forks a copy of itself, which sleeps. To
//! go back to a moment, the last copy from before it is woken, and runs up to that moment: a run is the same
//! each time.

use std::os::unix::net::UnixStream;

use serde::{Deserialize, Serialize};
use simulation::MILLISECOND;

use super::goal::Goal;
use super::order::{Line, Points};
use super::process::{self, Fork};

/// The interval between two copies, in cycles: 100 ms.
const EVERY: u64 = 100 * MILLISECOND;

/// The shortest interval between two copies in a run whose end is known: there the interval shrinks towards
/// the end.
const CLOSEST: u64 = MILLISECOND;

/// The most copies that are kept.
const MOST: usize = 32;

/// The copies that sleep, the oldest first.
#[derive(Default)]
pub struct History {
    copies: Vec<Copy>,
    /// The cycle at which the next copy is due.
    next: u64,
}

/// A process that sleeps.
struct Copy {
    cycle: u64,
    waker: UnixStream,
}

/// The message that wakes a process.
#[derive(Serialize, Deserialize)]
pub struct Wake {
    pub goal: Goal,
    pub points: Points,
    /// The cycles of the copies that still exist: the woken one and those before it.
    copies: Vec<u64>,
}

impl History {
    pub fn is_due(&self, cycle: u64) -> bool {
        cycle >= self.next
    }

    /// Plans the next copy in a run from `cycle` that ends at `until`, if that is known.
    pub fn plan(&mut self, cycle: u64, until: Option<u64>) {
        self.next = match until.map(|until| until.saturating_sub(cycle)) {
            None => self.copies.last().map_or(cycle, |last| (last.cycle + EVERY).max(cycle)),
            Some(left) if left > 2 * CLOSEST => cycle + (left / 2).min(EVERY),
            Some(_) => u64::MAX,
        };
    }

    /// Leaves a copy of this process, at `cycle`. Returns `None` in this process. Returns the message in the
    /// copy once that is woken; it has then left another copy in its place. All processes end with the
    /// connection to `server`.
    pub fn leave_copy(&mut self, cycle: u64, server: &Line) -> Option<Wake> {
        let Ok((sleeper, waker)) = UnixStream::pair() else { return None };
        self.copies.push(Copy { cycle, waker });
        let mut wake = None;
        loop {
            match process::fork() {
                Ok(Fork::Original) => break,
                Ok(Fork::Copy) => wake = Some(self.sleep(&sleeper, server)),
                Err(_) => {
                    // The system allows no more processes.
                    self.copies.pop();
                    break;
                }
            }
        }
        self.thin_out(cycle);
        wake
    }

    fn sleep(&mut self, sleeper: &UnixStream, server: &Line) -> Wake {
        let wake = process::wait(sleeper, server.stream())
            .then(|| sleeper.try_clone().ok())
            .flatten()
            .and_then(|sleeper| Line::new(sleeper).receive::<Option<Wake>>())
            .flatten();
        let Some(wake) = wake else { process::leave() };
        self.copies.retain(|copy| wake.copies.contains(&copy.cycle));
        wake
    }

    /// Ends one copy if there are too many. The older copies are, the farther apart they are kept.
    fn thin_out(&mut self, now: u64) {
        if self.copies.len() <= MOST {
            return;
        }
        let gap = |index: usize| {
            let [before, after] = [index - 1, index + 1].map(|index| self.copies[index].cycle);
            (after - before) as f64 / (now + CLOSEST - before) as f64
        };
        let closest = (1..self.copies.len() - 1).min_by(|&one, &other| gap(one).total_cmp(&gap(other)));
        if let Some(index) = closest {
            self.copies.remove(index).end();
        }
    }

    /// The number of the last copy from before `cycle`.
    pub fn before(&self, cycle: u64) -> Option<usize> {
        self.copies.iter().rposition(|copy| copy.cycle < cycle)
    }

    /// The number of copies.
    pub fn len(&self) -> usize {
        self.copies.len()
    }

    pub fn cycle(&self, number: usize) -> u64 {
        self.copies[number].cycle
    }

    /// Wakes the copy of this number in place of this process, and ends the copies after it.
    pub fn wake(&mut self, number: usize, goal: Goal, points: Points) -> ! {
        self.copies.drain(number + 1..).for_each(Copy::end);
        let copies = self.copies.iter().map(|copy| copy.cycle).collect();
        let wake = Wake { goal, points, copies };
        if let Some(Copy { waker, .. }) = self.copies.pop() {
            let _ = Line::new(waker).send(&Some(wake));
        }
        process::leave()
    }

    /// Ends all copies, so that nothing leads back to before now.
    pub fn forget(&mut self) {
        self.copies.drain(..).for_each(Copy::end);
        self.next = 0;
    }
}

impl Copy {
    fn end(self) {
        // The copy may be gone already.
        let _ = Line::new(self.waker).send(&None::<Wake>);
    }
}
