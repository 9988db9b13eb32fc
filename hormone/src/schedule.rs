//! When AC_SEND probes which dock.
//!
//! The six docks take turns, [`STAGGER`] apart, so that their probes do not compete for the CPU and the
//! bridge. A dock can be [hurried](Schedule::hurry): its probe goes out at once, beside its turn. That
//! is how two modules find each other in little more than one period instead of three. Docks with a lossy
//! link are [probed quickly](Schedule::set_quick), beside their turns too; and [urgently](Schedule::urge)
//! once a neighbour misses them.
//!
//! A line that carries a probe makes a hormone wait, or drowns it. So docks by which a beat comes and goes
//! are not probed [around it](Schedule::expect).

use tasks::dock::{Dock, DockSet};
use tasks::link::backoff;

use crate::pacemaker::Beats;
use crate::time::{reached, until};

/// Each dock is probed once in this time, in milliseconds.
pub const PROBE_PERIOD: u16 = 40;

/// From one dock's turn to the next, in milliseconds.
pub const STAGGER: u16 = PROBE_PERIOD / 6;

/// From one probe to the next where links lose them, in milliseconds.
pub const QUICK_PERIOD: u16 = 10;

/// From one probe to the next where a neighbour has begun to miss them, in milliseconds. The module that
/// misses probes sends no more than before: its port is deaf while it sends, so it would miss more of them.
pub const URGENT_PERIOD: u16 = 4;

/// So many probes are urgent: for seven turns, after which a neighbour that sent no probe is given up.
const URGENT_PROBES: u8 = (7 * PROBE_PERIOD / URGENT_PERIOD) as u8;
const _: () = assert!(URGENT_PROBES.is_multiple_of(2), "first come the probes of all quick docks");

/// No probes are sent from this long before a beat until [`AFTER_BEAT`] after it, in milliseconds. A probe
/// leaves a back-off later and takes 1.6 ms. A hormone takes 2.3 ms to come here, and may be 3 ms early. To
/// all three neighbours of a branch it takes 5 ms.
pub const BEFORE_BEAT: u16 = backoff::LONGEST as u16 + 7;
pub const AFTER_BEAT: u16 = 8;

/// From the last dock's turn to the first one's: the remainder of the division above is added here.
const ROUND_GAP: u16 = PROBE_PERIOD - 5 * STAGGER;

/// The order of probes.
pub struct Schedule {
    hurried: DockSet,
    turn: Dock,
    turn_at: u16,
    quick: DockSet,
    quick_at: u16,
    /// The docks whose neighbours have begun to miss probes, and how many urgent ones are left. Every second
    /// time the other quick docks are probed, too.
    urgent: DockSet,
    urgent_probes: u8,
    beats: Beats,
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
            urgent: DockSet::EMPTY,
            urgent_probes: 0,
            beats: Beats { last_at: now, next_at: now, docks: DockSet::EMPTY },
        }
    }

    /// The dock to probe at `now`, or `None` until [`next_due`](Self::next_due). Call again until it
    /// is `None`.
    pub fn due(&mut self, now: u16) -> Option<Dock> {
        if !self.quick.is_empty() && reached(self.quick_at, now) {
            let is_between = self.urgent_probes & 1 != 0;
            let docks = if is_between { self.urgent.intersection(self.quick) } else { self.quick };
            let period = if self.is_urgent() { URGENT_PERIOD } else { QUICK_PERIOD };
            self.urgent_probes = self.urgent_probes.saturating_sub(1);
            self.quick_at = now.wrapping_add(period);
            self.hurried = self.hurried.union(docks);
        }
        let held = self.held(now);
        loop {
            if let Some(dock) = self.hurried.without(held).iter().next() {
                self.hurried.remove(dock);
                return Some(dock);
            }
            if !reached(self.turn_at, now) {
                return None;
            }
            let dock = self.end_turn(now);
            if held.is_empty() || !held.contains(dock) {
                return Some(dock);
            }
            self.hurried.insert(dock);
        }
    }

    /// Ends the turn of a dock. Returns whose turn it was.
    #[inline(never)] // else `due` saves more registers than it uses, mostly
    fn end_turn(&mut self, now: u16) -> Dock {
        let dock = self.turn;
        let (turn, gap) = match Dock::from_index(dock.index() + 1) {
            Some(next) => (next, STAGGER),
            None => (Dock::Front, ROUND_GAP),
        };
        self.turn = turn;
        self.turn_at = self.turn_at.wrapping_add(gap);
        // Turns missed by more than a period are dropped: a burst of old probes is of no use.
        if reached(self.turn_at.wrapping_add(PROBE_PERIOD), now) {
            self.turn_at = now.wrapping_add(gap);
        }
        dock
    }

    /// Milliseconds from `now` until a probe may be due; 0 if one is.
    pub fn next_due(&self, now: u16) -> u16 {
        let mut wait = until(self.turn_at, now);
        if !self.quick.is_empty() {
            wait = wait.min(until(self.quick_at, now));
        }
        if !self.hurried.is_empty() {
            let is_held = self.hurried.without(self.held(now)).is_empty();
            wait = wait.min(if is_held { self.until_clear(now) } else { 0 });
        }
        wait
    }

    /// Sets the beats around now; `None` if none is awaited.
    pub fn expect(&mut self, beats: Option<Beats>) {
        match beats {
            Some(beats) => self.beats = beats,
            // Else the times of the last beat would come round again when the clock wraps.
            None => self.beats.docks = DockSet::EMPTY,
        }
    }

    /// The docks that are not to be probed at `now`.
    fn held(&self, now: u16) -> DockSet {
        if self.until_clear(now) != 0 { self.beats.docks } else { DockSet::EMPTY }
    }

    /// Milliseconds from `now` until no beat is near.
    fn until_clear(&self, now: u16) -> u16 {
        let Beats { last_at, next_at, .. } = self.beats;
        let near = if reached(next_at.wrapping_sub(BEFORE_BEAT), now) { next_at } else { last_at };
        until(near.wrapping_add(AFTER_BEAT), now)
    }

    /// Probes `docks`, and no others, every [`QUICK_PERIOD`]. Returns whether these are more than before,
    /// from `now` on.
    pub fn set_quick(&mut self, docks: DockSet, now: u16) -> bool {
        if self.quick.is_empty() {
            self.quick_at = now;
        }
        if docks.is_empty() {
            self.urgent_probes = 0;
        }
        let is_more = self.quick.union(docks) != self.quick;
        self.quick = docks;
        is_more
    }

    /// Quick probes of `dock` are urgent from now on, for a while: its neighbour has begun to miss them.
    pub fn urge(&mut self, dock: Dock) {
        if self.urgent_probes == 0 {
            self.urgent = DockSet::EMPTY;
        }
        self.urgent.insert(dock);
        self.urgent_probes = URGENT_PROBES | self.urgent_probes & 1;
    }

    /// Whether any probes are urgent.
    pub fn is_urgent(&self) -> bool {
        self.urgent_probes > 0
    }

    /// Probes of `docks` are urgent no longer: there this module listens.
    pub fn calm(&mut self, docks: DockSet) {
        self.urgent = self.urgent.without(docks);
    }

    /// Probes `docks` at once: a neighbour waits for an answer, or does not know yet that it is not heard.
    pub fn hurry(&mut self, docks: DockSet) {
        self.hurried = self.hurried.union(docks);
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
        schedule.hurry(DockSet::of(&[Dock::Down]));
        schedule.hurry(DockSet::of(&[Dock::Down]));
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
    fn around_a_beat_the_docks_that_it_goes_by_wait_and_the_others_do_not() {
        for start in [0, 65_450] {
            let mut schedule = Schedule::new(start);
            let docks = DockSet::of(&[Dock::Front, Dock::Back, Dock::Left]);
            schedule.set_quick(DockSet::of(&[Dock::Back, Dock::Up]), start);
            let next_at = start.wrapping_add(100);
            schedule.expect(Some(Beats { last_at: start, next_at, docks }));
            let window = 100 - BEFORE_BEAT..100 + AFTER_BEAT;
            let sent = probes(&mut schedule, start, 200);
            let within = sent.iter().filter(|(at, _)| window.contains(at));
            assert!(within.clone().all(|(_, dock)| !docks.contains(*dock)), "{sent:?}");
            assert_eq!(within.filter(|(_, dock)| *dock == Dock::Up).count(), 3, "{sent:?}");
            let after: Vec<Dock> =
                sent.iter().filter(|(at, _)| *at == window.end).map(|(_, dock)| *dock).collect();
            assert_eq!(after, [Dock::Back, Dock::Left], "they have waited, each once");
            let turns = sent.iter().filter(|(_, dock)| *dock == Dock::Left).count();
            assert_eq!(turns, 5, "no turn is lost");
        }
    }

    /// How many probes of so many milliseconds from `start` leave by a dock, beside its turns.
    fn quick_probes(schedule: &mut Schedule, start: u16, milliseconds: u16, dock: Dock) -> u16 {
        let sent = probes(schedule, start, milliseconds);
        let all = sent.iter().filter(|(_, by)| *by == dock).count() as u16;
        all - milliseconds / PROBE_PERIOD
    }

    #[test]
    fn quick_probes_are_urgent_for_as_long_as_a_neighbour_waits() {
        let mut schedule = Schedule::new(0);
        let quick = DockSet::of(&[Dock::Up]);
        schedule.set_quick(quick, 0);
        schedule.urge(Dock::Up);
        assert_eq!(quick_probes(&mut schedule, 0, 280, Dock::Up), 280 / URGENT_PERIOD);
        assert_eq!(quick_probes(&mut schedule, 280, 280, Dock::Up), 280 / QUICK_PERIOD);
        // Over before its time, it is over.
        schedule.urge(Dock::Up);
        schedule.set_quick(DockSet::EMPTY, 560);
        schedule.set_quick(quick, 560);
        assert_eq!(quick_probes(&mut schedule, 560, 280, Dock::Up), 280 / QUICK_PERIOD);
    }

    #[test]
    fn they_are_where_the_neighbour_misses_them_and_this_module_does_not() {
        let (one, other) = (Dock::Up, Dock::Left);
        for start in [0, 65_400] {
            let urged = |docks: &[Dock]| {
                let mut schedule = Schedule::new(start);
                schedule.set_quick(DockSet::of(&[one, other]), start);
                docks.iter().for_each(|dock| schedule.urge(*dock));
                schedule
            };
            let [urgent, seldom] = [240 / URGENT_PERIOD, 240 / URGENT_PERIOD / 2];
            let sent = |mut schedule, dock| quick_probes(&mut schedule, start, 240, dock);
            assert_eq!([one, other].map(|dock| sent(urged(&[one]), dock)), [urgent, seldom]);
            assert_eq!([one, other].map(|dock| sent(urged(&[one, other]), dock)), [urgent, urgent]);
            let calmed = || {
                let mut schedule = urged(&[one, other]);
                schedule.calm(DockSet::of(&[one]));
                schedule
            };
            assert_eq!([one, other].map(|dock| sent(calmed(), dock)), [seldom, urgent]);
        }
    }

    #[test]
    fn a_dock_is_urgent_no_longer_once_it_is_quick_no_more() {
        let mut schedule = Schedule::new(0);
        schedule.set_quick(DockSet::of(&[Dock::Up, Dock::Left]), 0);
        schedule.urge(Dock::Up);
        schedule.set_quick(DockSet::of(&[Dock::Left]), 0);
        assert_eq!(quick_probes(&mut schedule, 0, 240, Dock::Up), 0);
    }

    #[test]
    fn whoever_waits_for_a_beat_to_be_over_is_not_woken_without_end() {
        let mut schedule = Schedule::new(0);
        schedule.set_quick(DockSet::of(&[Dock::Up]), 0);
        let (mut now, mut wakes) = (0, 0);
        for beat in 1..=20 {
            let next_at = beat * 125;
            schedule.expect(Some(Beats { last_at: next_at - 125, next_at, docks: DockSet::of(&Dock::ALL) }));
            while now < beat * 125 {
                while schedule.due(now).is_some() {}
                let wait = schedule.next_due(now);
                assert_ne!(wait, 0, "at {now}");
                now += wait;
                wakes += 1;
            }
        }
        assert!(wakes <= now / STAGGER + now / QUICK_PERIOD + 20, "{wakes} in {now} ms");
    }

    #[test]
    fn without_beats_no_dock_waits_however_long_ago_the_last_one_was() {
        let mut schedule = Schedule::new(0);
        schedule.expect(Some(Beats { last_at: 0, next_at: 500, docks: DockSet::of(&Dock::ALL) }));
        probes(&mut schedule, 0, 400);
        schedule.expect(None);
        for second in 0..140 {
            let sent = probes(&mut schedule, (400 + second * 1_000_u32) as u16, 1_000);
            assert_eq!(sent.len(), 6 * 1_000 / usize::from(PROBE_PERIOD), "after {second} s");
        }
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
