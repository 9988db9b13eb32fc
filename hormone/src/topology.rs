//! What a module knows of its neighbours, from the probes it hears. Kept by AC_RECV.

use tasks::dock::Dock;

use crate::probe::Probe;
use crate::time::reached;

/// A neighbour that has been silent for this long is lost, in milliseconds: six probes.
pub const LOSS_TIMEOUT: u16 = 240;

/// For each of the module's docks, by index, the neighbour's dock that is attached to it.
pub type Neighbours = [Option<Dock>; 6];

/// Stands for "no neighbour" where [`Neighbours`] are bytes.
pub const NO_NEIGHBOUR: u8 = 0xFF;

/// `neighbours` as bytes: per dock the index of the neighbour's dock or [`NO_NEIGHBOUR`]. This is the
/// payload of AC_RECV's message to HORMONE and the field in [`Status`](crate::status::Status).
pub fn to_bytes(neighbours: &Neighbours) -> [u8; 6] {
    neighbours.map(|neighbour| neighbour.map_or(NO_NEIGHBOUR, Dock::index))
}

/// The inverse of [`to_bytes`], or `None` if `bytes` are not six or one of them is no dock.
pub fn from_bytes(bytes: &[u8]) -> Option<Neighbours> {
    if bytes.len() != 6 {
        return None;
    }
    let mut neighbours = [None; 6];
    for (neighbour, &byte) in neighbours.iter_mut().zip(bytes) {
        if byte != NO_NEIGHBOUR {
            *neighbour = Some(Dock::from_index(byte)?);
        }
    }
    Some(neighbours)
}

/// What a probe changed.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Heard {
    /// A neighbour appeared, went, or is attached by another dock than before.
    pub changed: bool,
    /// The sender does not know yet that it is heard: probe that dock at once.
    pub answer: bool,
}

#[derive(Clone, Copy)]
struct Link {
    /// The dock that is heard here.
    heard: Option<Dock>,
    /// Whether the other end hears this module.
    hears_us: bool,
    /// Meaningful while something is heard.
    lost_at: u16,
}

impl Link {
    const SILENT: Link = Link { heard: None, hears_us: false, lost_at: 0 };

    fn neighbour(&self) -> Option<Dock> {
        self.heard.filter(|_| self.hears_us)
    }
}

/// The module's docks and who is heard there.
///
/// A neighbour counts only when both ends hear each other. With a dock blind in one direction the two
/// modules would else disagree about being attached, and hormones would vanish between them.
pub struct Topology {
    links: [Link; 6],
}

impl Topology {
    /// A module that has heard nothing.
    #[expect(clippy::new_without_default, reason = "the state at power-up, not a value to fall back on")]
    pub const fn new() -> Self {
        Topology { links: [Link::SILENT; 6] }
    }

    /// Takes in `probe`, which arrived at `dock` at `now`.
    pub fn heard(&mut self, dock: Dock, probe: Probe, now: u16) -> Heard {
        let before = self.neighbour(dock);
        let hears_us = probe.hears == Some(dock);
        let answer = !hears_us || self.hears(dock) != Some(probe.dock);
        if let Some(link) = self.links.get_mut(usize::from(dock.index())) {
            *link = Link { heard: Some(probe.dock), hears_us, lost_at: now.wrapping_add(LOSS_TIMEOUT) };
        }
        Heard { changed: self.neighbour(dock) != before, answer }
    }

    /// Forgets who has been silent for [`LOSS_TIMEOUT`]; whether a neighbour was lost by it. Call at
    /// least every 20 ms: then a loss is noticed within 300 ms at both ends, even if only one of them
    /// went deaf.
    pub fn expire(&mut self, now: u16) -> bool {
        let mut changed = false;
        for link in &mut self.links {
            if link.heard.is_some() && reached(link.lost_at, now) {
                changed |= link.hears_us;
                *link = Link::SILENT;
            }
        }
        changed
    }

    /// The neighbour's dock attached to `dock`.
    pub fn neighbour(&self, dock: Dock) -> Option<Dock> {
        self.links.get(usize::from(dock.index())).and_then(Link::neighbour)
    }

    /// All neighbours, by dock.
    pub fn neighbours(&self) -> Neighbours {
        self.links.map(|link| link.neighbour())
    }

    /// The probe that leaves by `dock` now.
    pub fn probe(&self, dock: Dock) -> Probe {
        Probe { dock, hears: self.hears(dock) }
    }

    /// The dock heard at `dock`, whether or not it hears this module.
    fn hears(&self, dock: Dock) -> Option<Dock> {
        self.links.get(usize::from(dock.index())).and_then(|link| link.heard)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Dock::{Back, Down, Front, Left};

    const CALLING: Probe = Probe { dock: Back, hears: None };
    const ATTACHED: Probe = Probe { dock: Back, hears: Some(Front) };

    #[test]
    fn a_neighbour_counts_once_both_ends_hear_each_other() {
        let mut topology = Topology::new();
        assert_eq!(topology.probe(Front), Probe { dock: Front, hears: None });
        assert_eq!(topology.heard(Front, CALLING, 0), Heard { changed: false, answer: true });
        assert_eq!(topology.neighbour(Front), None);
        assert_eq!(topology.probe(Front), Probe { dock: Front, hears: Some(Back) });
        assert_eq!(topology.heard(Front, ATTACHED, 5), Heard { changed: true, answer: false });
        assert_eq!(topology.neighbours(), [Some(Back), None, None, None, None, None]);
        assert_eq!(topology.heard(Front, ATTACHED, 9), Heard { changed: false, answer: false });
    }

    #[test]
    fn a_new_neighbour_that_hears_us_already_is_still_answered() {
        let heard = Topology::new().heard(Front, ATTACHED, 0);
        assert_eq!(heard, Heard { changed: true, answer: true });
    }

    #[test]
    fn a_neighbour_that_went_deaf_is_none() {
        let mut topology = Topology::new();
        topology.heard(Front, ATTACHED, 0);
        assert_eq!(topology.heard(Front, CALLING, 40), Heard { changed: true, answer: true });
        assert_eq!(topology.neighbour(Front), None);
    }

    #[test]
    fn one_that_hears_another_of_our_docks_does_not_hear_this_one() {
        let mut topology = Topology::new();
        topology.heard(Front, Probe { dock: Back, hears: Some(Down) }, 0);
        assert_eq!(topology.neighbour(Front), None);
    }

    #[test]
    fn another_dock_in_the_old_ones_place_is_a_change() {
        let mut topology = Topology::new();
        topology.heard(Front, ATTACHED, 0);
        let turned = Probe { dock: Left, hears: Some(Front) };
        assert_eq!(topology.heard(Front, turned, 40), Heard { changed: true, answer: true });
        assert_eq!(topology.neighbour(Front), Some(Left));
    }

    #[test]
    fn silence_loses_a_neighbour_at_the_timeout_also_when_the_clock_wraps() {
        let mut topology = Topology::new();
        let last = 65_500;
        topology.heard(Front, ATTACHED, last);
        assert!(!topology.expire(last.wrapping_sub(1)), "a reading older than the probe");
        assert!(!topology.expire(last.wrapping_add(LOSS_TIMEOUT - 1)));
        assert!(topology.expire(last.wrapping_add(LOSS_TIMEOUT)));
        assert_eq!(topology.neighbour(Front), None);
        assert!(!topology.expire(last.wrapping_add(LOSS_TIMEOUT)), "lost only once");
    }

    #[test]
    fn losing_one_that_never_heard_us_changes_nothing() {
        let mut topology = Topology::new();
        topology.heard(Front, CALLING, 0);
        assert!(!topology.expire(LOSS_TIMEOUT));
        assert_eq!(topology.probe(Front).hears, None);
    }

    #[test]
    fn neighbours_survive_their_bytes() {
        let neighbours = [Some(Down), None, Some(Front), None, None, Some(Back)];
        assert_eq!(to_bytes(&neighbours), [5, 0xFF, 0, 0xFF, 0xFF, 1]);
        assert_eq!(from_bytes(&to_bytes(&neighbours)), Some(neighbours));
        assert_eq!(from_bytes(&[0, 1, 2, 3, 4, 6]), None);
        assert_eq!(from_bytes(&[0; 5]), None);
        assert_eq!(from_bytes(&[0; 7]), None);
    }
}
