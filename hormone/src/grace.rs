//! Lets a module act for a moment as if a neighbour that fell silent were still there.
//!
//! What falls silent is reported lost within 300 ms. Where three frames of four are lost that happens now and then to one
//! that is there, and if its leg rested at once, or all behind it took another type's beat, the robot would stumble. A
//! neighbour that comes, or sits there by another dock, counts at once.

use tasks::dock::{Dock, DockSet};

use crate::time::{reached, until};
use crate::topology::Neighbours;

/// How long a lost neighbour is still acted for, in milliseconds.
pub const GRACE: u16 = 400;

/// The neighbours that the module acts by.
pub struct Grace {
    neighbours: Neighbours,
    lost: DockSet,
    /// By dock, until when a lost one is acted for.
    until: [u16; 6],
}

impl Grace {
    /// A module that has no neighbours.
    #[expect(clippy::new_without_default, reason = "the state at power-up, not a value to fall back on")]
    pub const fn new() -> Self {
        Grace { neighbours: [None; 6], lost: DockSet::EMPTY, until: [0; 6] }
    }

    /// The neighbours are now `known`.
    pub fn update(&mut self, known: &Neighbours, now: u16) {
        let docks = (0..6).filter_map(Dock::from_index).zip(known);
        for ((dock, &known), (held, until)) in docks.zip(self.neighbours.iter_mut().zip(&mut self.until)) {
            if known.is_some() {
                *held = known;
                self.lost.remove(dock);
            } else if held.is_some() && !self.lost.contains(dock) {
                *until = now.wrapping_add(GRACE);
                self.lost.insert(dock);
            }
        }
    }

    /// Lets go of those lost for [`GRACE`]. Returns whether there were any.
    pub fn expire(&mut self, now: u16) -> bool {
        let mut changed = false;
        for dock in self.lost.iter() {
            if !reached(self.until(dock), now) {
                continue;
            }
            self.lost.remove(dock);
            if let Some(held) = self.neighbours.get_mut(usize::from(dock.index())) {
                *held = None;
            }
            changed = true;
        }
        changed
    }

    /// Milliseconds from `now` until [`expire`](Self::expire) is to be called, if it is.
    pub fn next_due(&self, now: u16) -> Option<u16> {
        self.lost.iter().map(|dock| until(self.until(dock), now)).min()
    }

    /// The neighbours to act by.
    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// The neighbour to act by at this dock.
    pub fn neighbour(&self, dock: Dock) -> Option<Dock> {
        self.neighbours.get(usize::from(dock.index())).copied().flatten()
    }

    fn until(&self, dock: Dock) -> u16 {
        self.until.get(usize::from(dock.index())).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Dock::{Back, Front, Left};

    const SPINE: Neighbours = [Some(Back), Some(Front), None, None, None, None];
    const TAIL: Neighbours = [Some(Back), None, None, None, None, None];
    const HEAD: Neighbours = [None, Some(Front), None, None, None, None];

    #[test]
    fn one_that_comes_counts_at_once_and_one_that_goes_after_the_grace() {
        let mut grace = Grace::new();
        grace.update(&SPINE, 65_500);
        assert_eq!(*grace.neighbours(), SPINE);
        assert_eq!(grace.next_due(65_500), None);
        grace.update(&TAIL, 65_500);
        assert_eq!(*grace.neighbours(), SPINE);
        assert_eq!(grace.next_due(65_510), Some(GRACE - 10));
        let end = 65_500_u16.wrapping_add(GRACE);
        assert!(!grace.expire(end.wrapping_sub(1)));
        assert!(grace.expire(end));
        assert_eq!(*grace.neighbours(), TAIL);
        assert!(!grace.expire(end));
    }

    #[test]
    fn one_that_comes_back_was_never_away() {
        let mut grace = Grace::new();
        grace.update(&SPINE, 0);
        grace.update(&TAIL, 0);
        grace.update(&SPINE, GRACE - 1);
        assert!(!grace.expire(GRACE));
        assert_eq!(*grace.neighbours(), SPINE);
    }

    #[test]
    fn each_has_a_grace_of_its_own() {
        let mut grace = Grace::new();
        grace.update(&SPINE, 0);
        grace.update(&HEAD, 0);
        grace.update(&[None; 6], 100);
        assert!(grace.expire(GRACE));
        assert_eq!(*grace.neighbours(), HEAD);
        assert_eq!(grace.next_due(GRACE), Some(100));
    }

    #[test]
    fn another_in_its_place_counts_at_once() {
        let mut grace = Grace::new();
        grace.update(&TAIL, 0);
        grace.update(&[None; 6], 0);
        grace.update(&[Some(Left), None, None, None, None, None], 50);
        assert_eq!(grace.neighbour(Front), Some(Left));
        assert!(!grace.expire(GRACE));
    }
}
