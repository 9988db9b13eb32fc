//! When AC_SEND probes which dock.
//!
//! The six docks take turns, [`STAGGER`] apart, so that their probes do not compete for the CPU and the
//! bridge. A dock can be [hurried](Schedule::hurry): its probe goes out at once, beside its turn. That
//! is how two modules find each other in little more than one period instead of three. Docks with a lossy
//! link are
//! [probed quickly](Schedule::set_quick), beside their turns too.

use tasks::dock::{Dock, DockSet};

use crate::time::{reached, until};

/// Each dock is probed once in this time, in milliseconds.
pub const PROBE_PERIOD: u16 = 40;

/// From one dock's turn to the next, in milliseconds.
pub const STAGGER: u16 = PROBE_PERIOD / 6;

/// From one probe to the next where links lose them, in milliseconds.
pub const QUICK_PERIOD: u16 = 10;

/// From the last dock's turn to the first one's: what the division above leaves over comes here.
const ROUND_GAP: u16 = PROBE_PERIOD - 5 * STAGGER;

/// The order of probes.
pub struct Schedule {
    hurried: DockSet,
    turn: Dock,
    turn_at: u16,
    quick: DockSet,
    quick_at: u16,
}

impl Schedule {
    /// A schedule whose first turn is at `now`.
    pub const fn new(now: u16) -> Self {
        Schedule {
            hurried: DockSet::EMPTY,
            turn: Dock::Front,
            turn_at: now,
            quick: DockSet::EMPTY,
            quick_at: now,
        }
    }

    /// The dock to probe at `now`, or `None` until [`next_due`](Self::next_due). Call again until it
    /// is `None`.
    pub fn due(&mut self, now: u16) -> Option<Dock> {
        if !self.quick.is_empty() && reached(self.quick_at, now) {
            self.quick_at = now.wrapping_add(QUICK_PERIOD);
            self.hurried = self.hurried.union(self.quick);
        }
        if let Some(dock) = self.hurried.iter().next() {
            self.hurried.remove(dock);
            return Some(dock);
        }
        if !reached(self.turn_at, now) {
            return None;
        }
        let dock = self.turn;
        let (turn, gap) = match Dock::from_index(dock.index() + 1) {
            Some(next) => (next, STAGGER),
            None => (Dock::Front, ROUND_GAP),
        };
        self.turn = turn;
        self.turn_at = self.turn_at.wrapping_add(gap);
        // Turns missed by more than a period are dropped: a burst of old probes helps nobody.
        if reached(self.turn_at.wrapping_add(PROBE_PERIOD), now) {
            self.turn_at = now.wrapping_add(gap);
        }
        Some(dock)
    }

    /// Milliseconds from `now` until a probe is due; 0 if one is.
    pub fn next_due(&self, now: u16) -> u16 {
        if !self.hurried.is_empty() {
            return 0;
        }
        let turn = until(self.turn_at, now);
        if self.quick.is_empty() { turn } else { turn.min(until(self.quick_at, now)) }
    }

    /// Probes `docks`, and no others, every [`QUICK_PERIOD`]. Returns whether these are more than before,
    /// from `now` on.
    pub fn set_quick(&mut self, docks: DockSet, now: u16) -> bool {
        if self.quick.is_empty() {
            self.quick_at = now;
        }
        let is_more = self.quick.union(docks) != self.quick;
        self.quick = docks;
        is_more
    }

    /// Probes `dock` at once: its neighbour waits for an answer.
    pub fn hurry(&mut self, dock: Dock) {
        self.hurried.insert(dock);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The probes of so many milliseconds from `start`, polled each millisecond.
    fn probes(schedule: &mut Schedule, start: u16, milliseconds: u16) -> Vec<(u16, Dock)> {
        let mut sent = Vec::new();
        for elapsed in 0..milliseconds {
            let now = start.wrapping_add(elapsed);
            while let Some(dock) = schedule.due(now) {
                sent.push((elapsed, dock));
            }
        }
        sent
    }

    #[test]
    fn each_dock_has_its_own_time_once_a_period_also_when_the_clock_wraps() {
        let start = 65_500;
        let sent = probes(&mut Schedule::new(start), start, 3 * PROBE_PERIOD);
        for dock in Dock::ALL {
            let times: Vec<u16> = sent.iter().filter(|probe| probe.1 == dock).map(|probe| probe.0).collect();
            let first = u16::from(dock.index()) * STAGGER;
            assert_eq!(times, [first, first + PROBE_PERIOD, first + 2 * PROBE_PERIOD]);
        }
    }

    #[test]
    fn a_hurried_dock_is_probed_once_at_once_and_keeps_its_turn() {
        let mut schedule = Schedule::new(0);
        probes(&mut schedule, 0, 10);
        schedule.hurry(Dock::Down);
        schedule.hurry(Dock::Down);
        assert_eq!(schedule.next_due(10), 0);
        assert_eq!(probes(&mut schedule, 10, 2), [(0, Dock::Down)]);
        assert_eq!(probes(&mut schedule, 12, 1), [(0, Dock::Left)]);
        assert_eq!(probes(&mut schedule, 13, 24).last(), Some(&(17, Dock::Down)));
    }

    #[test]
    fn next_due_is_when_the_next_probe_goes_out() {
        let mut schedule = Schedule::new(0);
        let mut now = 0;
        for _ in 0..100 {
            let wait = schedule.next_due(now);
            for early in 0..wait {
                assert_eq!(schedule.due(now + early), None);
            }
            now += wait;
            assert!(schedule.due(now).is_some());
        }
        assert_eq!(now, 99 / 6 * PROBE_PERIOD + 99 % 6 * STAGGER);
    }

    #[test]
    fn a_late_probe_does_not_shift_the_next() {
        let mut schedule = Schedule::new(0);
        assert_eq!(schedule.due(4), Some(Dock::Front));
        assert_eq!(schedule.next_due(4), STAGGER - 4);
    }

    #[test]
    fn a_stalled_task_does_not_burst() {
        let mut schedule = Schedule::new(0);
        assert!(probes(&mut schedule, 1_000, 1).len() <= 2);
        assert_eq!(probes(&mut schedule, 1_001, PROBE_PERIOD).len(), 6);
    }

    #[test]
    fn quick_docks_are_probed_every_ten_milliseconds_until_they_are_quick_no_more() {
        let mut schedule = Schedule::new(0);
        let quick = DockSet::of(&[Dock::Back, Dock::Up]);
        probes(&mut schedule, 0, 100);
        assert!(schedule.set_quick(quick, 100));
        assert!(!schedule.set_quick(quick, 105));
        let sent = probes(&mut schedule, 100, 120);
        for (dock, number) in [(Dock::Back, 12 + 3), (Dock::Up, 12 + 3), (Dock::Front, 3)] {
            assert_eq!(sent.iter().filter(|probe| probe.1 == dock).count(), number, "{dock:?}");
        }
        assert!(schedule.next_due(219) <= QUICK_PERIOD);
        assert!(!schedule.set_quick(DockSet::EMPTY, 220));
        assert_eq!(probes(&mut schedule, 220, PROBE_PERIOD).len(), 6);
    }
}
