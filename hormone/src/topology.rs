//! A module's knowledge of its neighbours, from the probes that it hears. AC_RECV keeps it.
//!
//! A neighbour that falls silent is lost after 270 ms, six probes. Where three probes of four are lost, that
//! would happen again and again to a neighbour that is there (six in a row: 0.75^6, 18 %). So a link that has
//! come back from a gap of two probes or more counts as lossy for a while, and as long as it loses more than
//! one probe of four. Both ends probe a lossy link every 10 ms beside its turns, except around
//! [beats](crate::schedule), so every 8 ms in the mean. Its neighbour may be silent for 18 times the mean
//! silence between its probes and the time for which probes wait behind two messages, 900 ms at most. In that
//! time some sixty probes go out: all are lost with a chance of 0.75^60, 3 in 10^8. The mean is over 64
//! probes. Over 16 it would be half of what it should be often enough to lose a neighbour a minute in a robot
//! of 100 modules. Where fewer probes are lost, the time is that of a good link.
//!
//! Where loss sets in suddenly, a link that was good has only those 270 ms. So once a probe is missing, 62 ms
//! after the last one, the module asks its neighbour for more, and the neighbour sends one every 4 ms for as
//! long as the module would wait for it. The module that misses probes sends one every 8 or 10 ms, even if it
//! is asked for more itself: more would drown those that come.
//!
//! What a new link loses is not known. It counts as lossy for a fifth of a second. Its neighbour is given the
//! time of a lossy link until fifteen quick probes have come in a row, 120 ms.

use tasks::dock::{Dock, DockSet};
use tasks::link::backoff;
use tasks::link::port::RETRY_LIMIT;
use tasks::link::sender::ACK_TIMEOUT;

use crate::neighbours::Neighbours;
use crate::probe::Probe;
use crate::schedule::{AFTER_BEAT, BEFORE_BEAT, PROBE_PERIOD};
use crate::time::reached;

/// A neighbour that has been silent for this long is lost, in milliseconds: six probes, and what the period
/// of [looks](Topology::expire) leaves of 300 ms.
pub const LOSS_TIMEOUT: u16 = 270;

/// The longest that a neighbour may be silent over a lossy link, in milliseconds.
pub const LOSSY_TIMEOUT: u16 = 900;

/// The mean silence is taken over about so many probes: the last one counts for this part of it.
const MEAN_OVER: u16 = 64;

/// How long probes wait behind two messages that are sent in vain, in milliseconds: a try of each takes its
/// frame, up to 2 ms, its ACK's time, the back-off, and a probe that comes in, up to 2 ms.
const IN_VAIN: u16 = 2 * (RETRY_LIMIT as u16 + 1) * (2 + ACK_TIMEOUT + backoff::LONGEST as u16 + 2);

/// The silences of a link that loses one probe of four, and the start value for a link that was good until
/// now; half a millisecond of the mean allows for rounding. A link counts as lossy while its silences are
/// above this. Where three probes of ten are lost, the mean falls this low at one probe of 20; where four of
/// ten are lost, at one of 300,000.
const FEW_SILENCES: u16 = 11 * MEAN_OVER;

/// So many probes in a row, odd and even by turns, show that few are lost, however seldom they come. Where
/// one of four is lost, such a row occurs by chance at one probe of two million. A link that is full of
/// messages has no room for a probe every 8 ms, and so has a mean of 14 ms.
const WHOLE_ROW: u8 = 64;

/// How long a new link is given the time of a lossy one if it loses nothing, in milliseconds.
pub const UNKNOWN_FOR: u16 = 120;

/// The silences of a new link. Each probe that follows another by 8 ms reduces them by three.
const UNKNOWN_SILENCES: u16 = FEW_SILENCES + UNKNOWN_FOR * 3 / 8;

/// A silence longer than this is a gap, in milliseconds: two probes or more are missing. Where only one is
/// missing, and the next one waits for a beat to be over and for its back-off, the silence is shorter.
const GAP: u16 = 2 * PROBE_PERIOD + BEFORE_BEAT + AFTER_BEAT + backoff::LONGEST as u16 + 1;

/// After a silence longer than this, in milliseconds, a probe is missing, and the module asks for more.
const MISSING: u16 = GAP - PROBE_PERIOD;

/// How long a link counts as lossy after a gap that ended, in milliseconds.
const LOSSY_FOR: u16 = 8_000;

/// How long a new link counts as lossy at least, in milliseconds.
const NEW_FOR: u16 = 200;

/// The changes that a probe brought.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Heard {
    /// A neighbour appeared, went, or is attached by another dock than before.
    pub changed: bool,
    /// The sender does not know yet that it is heard: probe that dock at once.
    pub answer: bool,
    /// The sender misses probes of this module from now on.
    pub asks: bool,
}

#[derive(Clone, Copy)]
struct Link {
    /// The dock that is heard here.
    heard: Option<Dock>,
    /// Whether the other end hears this module.
    hears_us: bool,
    /// Whether the other end misses probes of this module.
    wants_more: bool,
    /// Meaningful while something is heard.
    heard_at: u16,
    lossy_until: Option<u16>,
    /// Over a lossy link, [`MEAN_OVER`] times the mean silence between probes, in milliseconds.
    silences: u16,
    /// Probes that came odd and even by turns, up to the last one; at most [`WHOLE_ROW`].
    row: u8,
    /// Whether the last probe that was heard was odd.
    heard_odd: bool,
    /// Whether the last probe that left was odd.
    sent_odd: bool,
}

impl Link {
    const SILENT: Link = Link {
        heard: None,
        hears_us: false,
        wants_more: false,
        heard_at: 0,
        lossy_until: None,
        silences: UNKNOWN_SILENCES,
        row: 0,
        heard_odd: false,
        sent_odd: false,
    };

    fn neighbour(&self) -> Option<Dock> {
        self.heard.filter(|_| self.hears_us)
    }

    /// Takes in a probe.
    fn hear(&mut self, probe: Probe, hears_us: bool, now: u16) {
        let silence = self.silence(now);
        if self.is_lossy() {
            self.silences = self.silences - self.silences / MEAN_OVER + silence.min(LOSSY_TIMEOUT);
        } else if self.heard.is_some() {
            self.silences = FEW_SILENCES;
        }
        self.row = if probe.is_odd == self.heard_odd { 0 } else { (self.row + 1).min(WHOLE_ROW) };
        self.heard_odd = probe.is_odd;
        if self.heard != Some(probe.dock) {
            self.lossy_until = Some(now.wrapping_add(NEW_FOR));
        } else if silence > GAP {
            self.lossy_until = Some(now.wrapping_add(LOSSY_FOR));
        }
        self.heard = Some(probe.dock);
        self.hears_us = hears_us;
        self.wants_more = probe.wants_more;
        self.heard_at = now;
    }

    /// Milliseconds since the last probe; 0 for a clock that was read before that probe came.
    fn silence(&self, now: u16) -> u16 {
        if reached(self.heard_at, now) { now.wrapping_sub(self.heard_at) } else { 0 }
    }

    /// Whether probes are lost, in one direction or the other.
    fn is_lossy(&self) -> bool {
        self.lossy_until.is_some() || self.wants_more
    }

    fn loses_few(&self) -> bool {
        self.silences <= FEW_SILENCES || self.row == WHOLE_ROW
    }

    /// Whether probes of the other end are missing, or were a while ago.
    fn is_missing(&self, now: u16) -> bool {
        self.heard.is_some() && (self.lossy_until.is_some() || self.is_silent(now))
    }

    /// Whether probes of the other end are missing now.
    fn is_silent(&self, now: u16) -> bool {
        self.silence(now) > MISSING
    }

    fn is_lost(&self, now: u16) -> bool {
        self.heard.is_some() && reached(self.heard_at.wrapping_add(self.timeout()), now)
    }

    /// How long the other end may be silent, in milliseconds.
    fn timeout(&self) -> u16 {
        if !self.is_lossy() || self.silences <= FEW_SILENCES {
            return LOSS_TIMEOUT;
        }
        (self.silences / MEAN_OVER * 18 + IN_VAIN).min(LOSSY_TIMEOUT)
    }
}

/// The module's docks and the neighbours heard there.
///
/// A neighbour counts only when both ends hear each other. Otherwise, with a dock blind in one direction, the
/// two modules would disagree about being attached, and hormones would vanish between them.
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
        let mut asks = false;
        if let Some(link) = self.link_mut(dock) {
            asks = probe.wants_more && !link.wants_more && link.neighbour().is_some();
            link.hear(probe, hears_us, now);
        }
        Heard { changed: self.neighbour(dock) != before, answer, asks }
    }

    /// Forgets neighbours that have been silent for [`LOSS_TIMEOUT`], or over a lossy or new link for up to
    /// [`LOSSY_TIMEOUT`]. Returns the docks by which a neighbour was lost, to be probed at once. Call at
    /// least every 20 ms. Then both ends notice the loss of a neighbour within 300 ms, even if only one of
    /// them went deaf. This does not hold over a link that loses more than one probe of six, nor in the first
    /// [`UNKNOWN_FOR`] of a link.
    pub fn expire(&mut self, now: u16) -> DockSet {
        let mut lost = DockSet::EMPTY;
        for (index, link) in (0..).zip(&mut self.links) {
            if link.is_lost(now) {
                if link.hears_us
                    && let Some(dock) = Dock::from_index(index)
                {
                    lost.insert(dock);
                }
                *link = Link::SILENT;
            }
            if link.lossy_until.is_some_and(|until| reached(until, now)) {
                if link.loses_few() {
                    link.lossy_until = None;
                    link.silences = link.silences.min(FEW_SILENCES); // the other end may call it lossy yet
                } else {
                    link.lossy_until = Some(now); // keeps it past when the clock wraps
                }
            }
        }
        lost
    }

    /// The neighbour's dock attached to `dock`.
    pub fn neighbour(&self, dock: Dock) -> Option<Dock> {
        self.link(dock).and_then(Link::neighbour)
    }

    /// All neighbours, by dock.
    pub fn neighbours(&self) -> Neighbours {
        self.links.map(|link| link.neighbour())
    }

    /// The probe that leaves by `dock` at `now`. One that does not leave is [taken back](Self::take_back).
    pub fn probe(&mut self, dock: Dock, now: u16) -> Probe {
        let Some(link) = self.link_mut(dock) else {
            return Probe { dock, hears: None, wants_more: false, is_odd: false };
        };
        link.sent_odd = !link.sent_odd;
        Probe { dock, hears: link.heard, wants_more: link.is_missing(now), is_odd: link.sent_odd }
    }

    /// Takes back the last probe for `dock`: it did not leave, so the other end can't miss it.
    pub fn take_back(&mut self, dock: Dock) {
        if let Some(link) = self.link_mut(dock) {
            link.sent_odd = !link.sent_odd;
        }
    }

    /// The docks whose links lose probes in one direction or the other, to be probed quickly.
    pub fn lossy(&self, now: u16) -> DockSet {
        self.docks_where(|link| link.wants_more || link.is_missing(now))
    }

    /// The docks where a probe of the other end is missing now.
    pub fn silent(&self, now: u16) -> DockSet {
        self.docks_where(|link| link.is_silent(now))
    }

    #[inline(always)]
    fn docks_where(&self, is_one: impl Fn(&Link) -> bool) -> DockSet {
        let mut docks = DockSet::EMPTY;
        for (index, link) in (0..).zip(&self.links) {
            if is_one(link)
                && let Some(dock) = Dock::from_index(index)
            {
                docks.insert(dock);
            }
        }
        docks
    }

    /// The dock heard at `dock`, whether or not it hears this module.
    fn hears(&self, dock: Dock) -> Option<Dock> {
        self.link(dock).and_then(|link| link.heard)
    }

    fn link(&self, dock: Dock) -> Option<&Link> {
        self.links.get(usize::from(dock.index()))
    }

    fn link_mut(&mut self, dock: Dock) -> Option<&mut Link> {
        self.links.get_mut(usize::from(dock.index()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::schedule::QUICK_PERIOD;
    use Dock::{Back, Down, Front, Left};

    const CALLING: Probe = Probe { dock: Back, hears: None, wants_more: false, is_odd: false };
    const ATTACHED: Probe = Probe { hears: Some(Front), ..CALLING };

    /// From one probe to the next over a lossy link that loses none, in the mean.
    const QUICK: u16 = PROBE_PERIOD / (PROBE_PERIOD / QUICK_PERIOD + 1);

    /// The topology at `now`, when a good link at this dock has been there for a second. Its last probe came
    /// at `now`.
    fn good_since_a_second(dock: Dock, now: u16) -> Topology {
        let mut topology = Topology::new();
        for before in (0..=1_000).rev().step_by(QUICK.into()) {
            topology.heard(dock, ATTACHED, now.wrapping_sub(before));
            topology.expire(now.wrapping_sub(before));
        }
        topology
    }

    #[test]
    fn a_neighbour_counts_once_both_ends_hear_each_other() {
        let mut topology = Topology::new();
        assert_eq!(topology.probe(Front, 0), Probe { dock: Front, is_odd: true, ..CALLING });
        assert_eq!(topology.heard(Front, CALLING, 0), Heard { changed: false, answer: true, asks: false });
        assert_eq!(topology.neighbour(Front), None);
        assert_eq!(topology.probe(Front, 0).hears, Some(Back));
        assert_eq!(topology.heard(Front, ATTACHED, 5), Heard { changed: true, answer: false, asks: false });
        assert_eq!(topology.neighbours(), [Some(Back), None, None, None, None, None]);
        assert_eq!(topology.heard(Front, ATTACHED, 9), Heard { changed: false, answer: false, asks: false });
    }

    #[test]
    fn a_new_neighbour_that_hears_us_already_is_still_answered() {
        let heard = Topology::new().heard(Front, ATTACHED, 0);
        assert_eq!(heard, Heard { changed: true, answer: true, asks: false });
    }

    #[test]
    fn a_neighbour_that_went_deaf_is_none() {
        let mut topology = Topology::new();
        topology.heard(Front, ATTACHED, 0);
        assert_eq!(topology.heard(Front, CALLING, 40), Heard { changed: true, answer: true, asks: false });
        assert_eq!(topology.neighbour(Front), None);
    }

    #[test]
    fn one_that_hears_another_of_our_docks_does_not_hear_this_one() {
        let mut topology = Topology::new();
        topology.heard(Front, Probe { hears: Some(Down), ..CALLING }, 0);
        assert_eq!(topology.neighbour(Front), None);
    }

    #[test]
    fn another_dock_in_the_old_ones_place_is_a_change() {
        let mut topology = Topology::new();
        topology.heard(Front, ATTACHED, 0);
        let turned = Probe { dock: Left, ..ATTACHED };
        assert_eq!(topology.heard(Front, turned, 40), Heard { changed: true, answer: true, asks: false });
        assert_eq!(topology.neighbour(Front), Some(Left));
    }

    #[test]
    fn silence_loses_a_neighbour_at_the_timeout_also_when_the_clock_wraps() {
        let last = 65_500;
        let mut topology = good_since_a_second(Front, last);
        assert!(topology.expire(last.wrapping_sub(1)).is_empty(), "a reading older than the probe");
        assert!(topology.expire(last.wrapping_add(LOSS_TIMEOUT - 1)).is_empty());
        assert_eq!(topology.expire(last.wrapping_add(LOSS_TIMEOUT)), DockSet::of(&[Front]));
        assert_eq!(topology.neighbour(Front), None);
        assert!(topology.expire(last.wrapping_add(LOSS_TIMEOUT)).is_empty(), "lost only once");
    }

    /// Each end counts the time of a new link from the first probe that it has heard itself.
    #[test]
    fn a_good_link_that_the_other_end_calls_lossy_yet_is_none() {
        let mut topology = Topology::new();
        let asking = Probe { wants_more: true, ..ATTACHED };
        let mut now = 0;
        for silence in [QUICK; 26].into_iter().chain([12]) {
            now += silence;
            topology.heard(Front, asking, now);
            topology.expire(now);
        }
        assert_eq!(topology.expire(now + LOSS_TIMEOUT), DockSet::of(&[Front]));
    }

    #[test]
    fn losing_one_that_never_heard_us_changes_nothing() {
        let mut topology = Topology::new();
        topology.heard(Front, CALLING, 0);
        assert_eq!(topology.probe(Front, LOSSY_TIMEOUT).hears, Some(Back));
        assert!(topology.expire(LOSSY_TIMEOUT).is_empty());
        assert_eq!(topology.probe(Front, LOSSY_TIMEOUT).hears, None);
    }

    #[test]
    fn a_new_link_is_probed_quickly_and_given_more_time_until_it_is_known_to_be_good() {
        for (age, timeout) in
            [(0, 11 * 18 + IN_VAIN), (UNKNOWN_FOR - QUICK, 11 * 18 + IN_VAIN), (UNKNOWN_FOR, LOSS_TIMEOUT)]
        {
            let mut topology = Topology::new();
            for time in (0..=age).step_by(QUICK.into()) {
                topology.heard(Front, ATTACHED, time);
            }
            assert!(topology.expire(age + timeout - 30).is_empty(), "within {timeout} ms after {age} ms");
            assert!(!topology.expire(age + timeout).is_empty(), "{timeout} ms after {age} ms");
        }
        let mut topology = Topology::new();
        for time in (0..=600).step_by(QUICK.into()) {
            topology.heard(Front, ATTACHED, time);
            topology.expire(time);
            assert_eq!(topology.lossy(time).is_empty(), time >= NEW_FOR, "at {time}");
        }
    }

    #[test]
    fn one_who_misses_probes_is_waited_for_as_over_a_lossy_link() {
        const MISSES: Probe = Probe { wants_more: true, ..ATTACHED };
        for (probe, timeout) in [(ATTACHED, LOSS_TIMEOUT), (MISSES, 18 * 20 + IN_VAIN)] {
            let start = 1_000;
            let mut topology = good_since_a_second(Front, start);
            let last = start + 20 * 400;
            for time in (start..=last).step_by(20) {
                topology.heard(Front, probe, time);
                assert!(topology.expire(time).is_empty());
            }
            assert!(!topology.probe(Front, last).wants_more, "nothing is missing here");
            assert!(topology.expire(last + timeout - 30).is_empty(), "within {timeout} ms");
            assert!(!topology.expire(last + timeout).is_empty(), "after {timeout} ms");
        }
    }

    #[test]
    fn a_neighbour_that_begins_to_miss_probes_asks_once() {
        let mut topology = good_since_a_second(Front, 0);
        let missing = Probe { wants_more: true, ..ATTACHED };
        assert!(topology.heard(Front, missing, 10).asks);
        assert!(!topology.heard(Front, missing, 20).asks, "it did before");
        assert!(!topology.heard(Front, ATTACHED, 30).asks);
        assert!(topology.heard(Front, missing, 40).asks, "it misses them anew");
        // Each end of a new link asks for quick probes.
        let mut topology = Topology::new();
        for probe in [Probe { hears: None, ..missing }, missing] {
            assert!(!topology.heard(Back, probe, 50).asks);
        }
    }

    #[test]
    fn a_link_that_came_back_from_a_gap_is_lossy_for_a_while() {
        let mut topology = good_since_a_second(Front, 0);
        topology.heard(Front, ATTACHED, GAP);
        assert!(topology.lossy(GAP).is_empty());
        topology.heard(Front, ATTACHED, 2 * GAP + 1);
        assert_eq!(topology.lossy(2 * GAP + 1), DockSet::of(&[Front]));
        assert!(topology.probe(Front, 2 * GAP + 1).wants_more);
        let last = 2 * GAP + 1;
        assert!(topology.expire(last + LOSS_TIMEOUT - 1).is_empty());
        assert!(!topology.expire(last + LOSS_TIMEOUT).is_empty());

        let mut topology = good_since_a_second(Front, 1_000);
        for time in (1_150..10_000).step_by(10) {
            topology.heard(Front, ATTACHED, time);
            assert!(topology.expire(time).is_empty());
            assert_eq!(topology.lossy(time).is_empty(), time >= 1_150 + LOSSY_FOR, "at {time}");
        }
        topology.heard(Front, ATTACHED, 10_200);
        for time in (10_200..30_000).step_by(20) {
            topology.heard(Front, ATTACHED, time);
            topology.expire(time);
            assert!(!topology.lossy(time).is_empty(), "while every second probe is lost");
        }
    }

    #[test]
    fn a_link_that_loses_none_any_more_is_calm_soon_however_long_it_lost_some() {
        for seconds in [10, 45, 60] {
            let mut topology = good_since_a_second(Front, 1_000);
            let mut hear = |times: std::ops::Range<u32>, period: usize| {
                for time in times.step_by(period) {
                    topology.heard(Front, ATTACHED, time as u16);
                    topology.expire(time as u16);
                }
            };
            let calm = 1_150 + 1_000 * seconds;
            hear(1_150..calm, 20);
            hear(calm..calm + 3_000, 10);
            assert!(topology.lossy((calm + 2_990) as u16).is_empty(), "after {seconds} s");
        }
    }

    /// When a neighbour is given up over a link that has for a while passed only one of so many quick probes.
    fn timeout_where_one_arrives_of(probes: u16) -> u16 {
        let mut topology = good_since_a_second(Front, 0);
        let mut now = GAP + 1;
        for _ in 0..400 {
            topology.heard(Front, ATTACHED, now);
            now += 10 * probes;
        }
        let last = now - 10 * probes;
        (0..=LOSSY_TIMEOUT)
            .find(|wait| !topology.expire(last + wait).is_empty())
            .expect("it is given up some time")
    }

    #[test]
    fn a_neighbour_over_a_lossy_link_is_given_as_much_time_as_the_losses_ask_for() {
        assert_eq!(timeout_where_one_arrives_of(1), LOSS_TIMEOUT);
        assert!((680..780).contains(&timeout_where_one_arrives_of(2)));
        assert_eq!(timeout_where_one_arrives_of(4), LOSSY_TIMEOUT);
        assert_eq!(timeout_where_one_arrives_of(6), LOSSY_TIMEOUT);
    }

    /// Whether a probe arrives where this part of them is lost.
    fn arrives(random: &mut Random, loss: f64) -> bool {
        f64::from(random.below(1 << 24)) >= loss * f64::from(1 << 24)
    }

    /// The part of a hundred thousand probes at which a link that came back from a gap would count as good,
    /// where the part `loss` of them is lost.
    fn good_at_a_loss_of(loss: f64) -> f64 {
        let mut topology = good_since_a_second(Front, 0);
        topology.heard(Front, ATTACHED, GAP + 1);
        let (mut now, mut random, mut good) = (GAP + 1, Random::new(1), 0);
        let probes = 100_000;
        // Beside four probes 10 ms apart, the turn of the dock comes between two.
        for step in [10, 10, 10, 4, 6].into_iter().cycle().take(probes) {
            now = now.wrapping_add(step);
            if arrives(&mut random, loss) {
                topology.heard(Front, ATTACHED, now);
            }
            let link = topology.link(Front).expect("it is a dock");
            good += usize::from(link.silences <= FEW_SILENCES);
        }
        good as f64 / probes as f64
    }

    #[test]
    fn a_link_counts_as_lossy_while_it_loses_more_than_one_probe_of_four() {
        let [few, some, many] = [0.15, 0.35, 0.4].map(good_at_a_loss_of);
        assert!(few > 0.95 && some < 0.01 && many < 0.0001, "{few}, {some}, {many}");
    }

    /// After how many of `probes` probes a link counts as good that came back from a gap and is full of
    /// messages, where the part `loss` of them is lost.
    fn good_though_full_at_a_loss_of(loss: f64, probes: usize) -> Option<usize> {
        let mut topology = good_since_a_second(Front, 0);
        let (mut now, mut random, mut probe) = (GAP + 1, Random::new(1), ATTACHED);
        topology.heard(Front, probe, now);
        (0..probes).find(|_| {
            now = now.wrapping_add(14);
            probe.is_odd = !probe.is_odd;
            if arrives(&mut random, loss) {
                topology.heard(Front, probe, now);
            }
            topology.expire(now);
            topology.lossy(now).is_empty()
        })
    }

    #[test]
    fn a_link_full_of_messages_counts_as_lossy_until_a_long_row_of_probes_was_whole() {
        let soon = usize::from(LOSSY_FOR / 14);
        assert_eq!(good_though_full_at_a_loss_of(0.0, 2 * soon), Some(soon));
        let some = good_though_full_at_a_loss_of(0.05, 10 * soon);
        assert!(some.is_some_and(|probes| probes > soon), "{some:?}");
        assert_eq!(good_though_full_at_a_loss_of(0.25, 100_000), None);
    }

    #[test]
    fn probes_are_odd_and_even_by_turns_at_each_dock_but_for_one_that_does_not_leave() {
        let mut topology = Topology::new();
        let mut odd = |dock| topology.probe(dock, 0).is_odd;
        assert_eq!([odd(Front), odd(Front), odd(Front), odd(Back)], [true, false, true, true]);
        topology.take_back(Front);
        topology.take_back(Left);
        assert_eq!([Front, Back, Left].map(|dock| topology.probe(dock, 0).is_odd), [true, false, false]);
    }

    #[test]
    fn nothing_is_missing_by_a_reading_of_the_clock_older_than_the_probe() {
        let mut topology = good_since_a_second(Front, 1_000);
        assert!(!topology.probe(Front, 999).wants_more, "AC_RECV has run since AC_SEND read it");
        assert!(topology.lossy(999).is_empty());
        assert!(topology.probe(Front, 1_000 + GAP + 1).wants_more);
    }

    #[test]
    fn in_a_silence_and_for_a_neighbour_that_misses_probes_there_are_more() {
        let mut topology = good_since_a_second(Front, 0);
        assert!(topology.lossy(MISSING).is_empty() && !topology.probe(Front, MISSING).wants_more);
        assert!(!topology.silent(MISSING).contains(Front));
        assert_eq!(topology.lossy(MISSING + 1), DockSet::of(&[Front]));
        assert!(topology.silent(MISSING + 1).contains(Front));
        assert!(topology.probe(Front, MISSING + 1).wants_more);
        topology.heard(Front, Probe { wants_more: true, ..ATTACHED }, 10);
        assert_eq!(topology.lossy(11), DockSet::of(&[Front]));
        assert!(!topology.silent(11).contains(Front));
        assert!(!topology.probe(Front, 11).wants_more, "this end misses none");
        // It has come back from a gap. That one stays lossy for a while, but nothing is missing now.
        topology.heard(Front, ATTACHED, 10 + GAP + 1);
        assert!(topology.probe(Front, 11 + GAP).wants_more && !topology.silent(11 + GAP).contains(Front));
    }
}
