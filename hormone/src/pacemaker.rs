//! The local timer of Table 1, which runs from beat to beat from power-up on, and how hormones set it.
//!
//! A leader beats by it. Every other module takes up a hormone when it comes, and sets the timer by it. When
//! a hormone is lost on the way, the module acts by the timer as if it had come. So a gait goes on evenly
//! over links that lose three frames of four.
//!
//! ```text
//!   beat         beat         beat
//!    |------------|------------|---
//!    hormone      late: the timer has acted, and what comes then is dropped
//! ```
//!
//! A hormone that is early is the one least delayed, so it sets the timer, by an eighth of a beat at most;
//! one that is late moves it by 1 ms only.

use tasks::dock::DockSet;

use crate::data::Data;
use crate::gait::Gait;
use crate::pace::{NUMBERS, Pace};

/// How long after its beat a module waits for a hormone before the timer takes its place, in milliseconds:
/// longer than a way of some hundred hops without a loss delays it.
const PATIENCE: u16 = 12;

/// After so many beats of which not even a late hormone came, a module follows the hormone of another leader,
/// or of the same one by another way. One hormone may be lost, and one late. A module that followed whichever
/// came first would change its leader by a race where there are two ways.
pub const SILENT: u8 = 3;

/// How far [ahead](Pace::ahead_of) a hormone is that comes a beat late.
const LATE: u8 = NUMBERS - 1;

/// After so many beats without a hormone the module follows no rhythm any more: at the last of them it rests.
pub const MOST_MISSED: u8 = 8;

/// A loop's own beat comes in time, but for one of [`MOST_MISSED`]. Over lines that lose hormones more than
/// one of so many are overdue.
const LATENESS: u8 = 3;

/// The last beat and the next one.
#[derive(Clone, Copy)]
pub struct Beats {
    pub last_at: u16,
    pub next_at: u16,
    /// The docks by which hormones come and go at these beats.
    pub docks: DockSet,
}

/// A timer that counts beats.
pub struct Pacemaker {
    gait: Gait,
    /// The last beat that was, and when.
    last: Data,
    last_at: u16,
    rhythm: u8,
    /// The number of the last beat, as its leader counts.
    number: u8,
    /// Beats since the last hormone.
    missed: u8,
    /// 0 if the last beat is the leader's. Else a timer took the place of its hormone, here or on the way
    /// here, and this is 1 and how many hormones of a leader came by another way since then, less
    /// [`LATENESS`] for each beat whose hormone by this way was overdue.
    stale: u8,
    /// The last beat took the place of another, because the module that it came from knew better.
    is_corrected: bool,
}

impl Pacemaker {
    /// A timer at the start of a Period of `gait` at `now`, which knows no rhythm.
    pub const fn new(gait: Gait, now: u16) -> Self {
        Pacemaker {
            gait,
            last: Data::A,
            last_at: now,
            rhythm: 0,
            number: 0,
            missed: MOST_MISSED,
            stale: 1,
            is_corrected: false,
        }
    }

    /// The gait whose beats it counts.
    pub fn gait(&self) -> &Gait {
        &self.gait
    }

    /// The last beat, and when it was.
    pub fn last(&self) -> (Data, u16) {
        (self.last, self.last_at)
    }

    /// The rhythm that the module follows.
    pub fn rhythm(&self) -> u8 {
        self.rhythm
    }

    /// The number of the last beat.
    pub fn number(&self) -> u8 {
        self.number
    }

    /// Whether a timer took the place of the leader's hormone for the last beat, here or on the way here.
    pub fn is_made_good(&self) -> bool {
        self.stale > 0
    }

    /// Whether the module follows a rhythm.
    pub fn is_following(&self) -> bool {
        self.missed < MOST_MISSED
    }

    /// Beats since the last hormone.
    pub fn missed(&self) -> u8 {
        self.missed
    }

    /// Follows no rhythm from now on. The timer runs on.
    pub fn forget(&mut self) {
        self.missed = MOST_MISSED;
    }

    /// Passes over the beats that have gone by since the last one.
    pub fn skip(&mut self, now: u16) {
        let gone = now.wrapping_sub(self.last_at) / self.gait.beat;
        self.last_at = self.last_at.wrapping_add(gone.wrapping_mul(self.gait.beat.get()));
        self.number = self.number.wrapping_add(gone as u8);
        self.last = self.last.later((gone % u16::from(self.gait.beats.max(1))) as u8, self.gait.beats);
    }

    /// The beat that a leader has come to, if it has come to one since the last. Polled a beat late, it skips
    /// one.
    pub fn lead(&mut self, now: u16) -> Option<Data> {
        if now.wrapping_sub(self.last_at) < self.gait.beat.get() {
            return None;
        }
        self.skip(now);
        Some(self.last)
    }

    /// The beats around now, which come and go by `docks`.
    pub fn beats(&self, docks: DockSet) -> Beats {
        Beats { last_at: self.last_at, next_at: self.last_at.wrapping_add(self.gait.beat.get()), docks }
    }

    /// Milliseconds from `now` to a leader's next beat.
    pub fn until_beat(&self, now: u16) -> u16 {
        self.gait.beat.get().saturating_sub(now.wrapping_sub(self.last_at))
    }

    /// Makes good the beat whose hormone is overdue, if there is one, and returns it.
    pub fn make_good(&mut self, now: u16) -> Option<Data> {
        if !self.is_following() || now.wrapping_sub(self.last_at) < self.gait.beat.get() + PATIENCE {
            return None;
        }
        self.skip(now.wrapping_sub(PATIENCE));
        self.missed += 1;
        // Lines may lose hormones of this way.
        self.stale = self.stale.saturating_sub(LATENESS).max(1);
        self.is_corrected = false;
        Some(self.last)
    }

    /// Milliseconds from `now` until a hormone is overdue; `None` if none is awaited.
    pub fn until_overdue(&self, now: u16) -> Option<u16> {
        let patience = self.gait.beat.get() + PATIENCE;
        self.is_following().then(|| patience.saturating_sub(now.wrapping_sub(self.last_at)))
    }

    /// Takes in a hormone of this gait. Returns whether it is news. A hormone for a beat that has been, even
    /// if that was made good, is no news; nor is one from another leader or by another way while the present
    /// leader beats. `same_way` says that it came by the dock that the rhythm comes by.
    pub fn hear(&mut self, pace: Pace, same_way: bool, now: u16) -> bool {
        let beat = self.gait.beat.get();
        let elapsed = now.wrapping_sub(self.last_at);
        if !same_way && self.is_bound() && !self.has_better(pace) {
            return false;
        }
        let is_known = same_way && self.is_following();
        let is_same = is_known && pace.rhythm == self.rhythm;
        // A link keeps the order of hormones. After a hormone of this beat comes none of the same or an
        // earlier beat, unless it went round a loop.
        let is_in_order = self.missed > 0 || elapsed < beat / 4;
        match pace.ahead_of(self.number) {
            0 if is_same && is_in_order => return self.hear_again(pace),
            // A module on the way had another type for a moment, and this beat was made good meanwhile. In a
            // ring, where hormones have a lifetime, another rhythm is another leader's, at its own time.
            0 if is_known && self.is_made_good() && pace.lifetime.is_none() && elapsed < beat / 4 => {
                // One that was made good may be this module's own, back round a loop: it shows no leader.
                let missed = self.missed;
                let is_news = self.hear_again(pace);
                if pace.is_made_good {
                    self.missed = missed;
                }
                return is_news;
            }
            1 if is_same && elapsed < beat - beat / 8 => {
                // A step may be shortened this far. The timer acts when the step is over.
                self.last_at = self.last_at.wrapping_sub(beat / 8);
                self.missed = 0;
                return false;
            }
            1 if is_same && elapsed < beat + beat / 2 => {
                let due = self.last_at.wrapping_add(beat);
                self.take(pace, if elapsed > beat { due.wrapping_add(1) } else { now });
                return true;
            }
            // A hormone of the beat before, which is over; unless it is this module that counts wrong.
            LATE if is_same && is_in_order && self.is_bound() => return false,
            _ => {}
        }
        let is_too_soon = self.is_beating(now) && !self.succeeds(pace, now);
        // The module before this one may follow another beat than before, as this one is to do at once.
        if is_too_soon && (!is_known || pace.lifetime.is_some() || !self.may_be_corrected()) {
            return false;
        }
        self.take(pace, now);
        self.is_corrected = is_too_soon;
        true
    }

    /// Takes in a hormone of the last beat. Returns whether it is news: a beat that was made good by another
    /// letter is corrected.
    fn hear_again(&mut self, pace: Pace) -> bool {
        if pace.data != self.last {
            let is_correction = self.may_be_corrected();
            if is_correction {
                self.take(pace, self.last_at);
                self.is_corrected = true;
            }
            return is_correction;
        }
        if self.missed > 0 {
            self.last_at = self.last_at.wrapping_add(1);
        }
        self.rhythm = pace.rhythm;
        self.missed = 0;
        if !pace.is_made_good {
            self.stale = 0;
        }
        false
    }

    /// Takes in a hormone of another gait, and changes to that gait. Returns whether it does: a hormone by
    /// another way does not count while the present leader beats.
    pub fn change(&mut self, gait: Gait, pace: Pace, same_way: bool, now: u16) -> bool {
        if self.is_bound() && !same_way || self.is_beating(now) && !self.succeeds(pace, now) {
            return false;
        }
        self.gait = gait;
        self.take(pace, now);
        true
    }

    /// Whether the module that the last beat came from may know better. It may correct a beat once, because
    /// round a loop two modules could correct each other.
    fn may_be_corrected(&self) -> bool {
        self.is_made_good() && !self.is_corrected
    }

    /// Whether the hormone of the last beat came, and the next one is not due yet.
    fn is_beating(&self, now: u16) -> bool {
        let beat = self.gait.beat.get();
        self.is_following() && self.missed == 0 && now.wrapping_sub(self.last_at) < beat - beat / 8
    }

    /// Whether it follows hormones that come by one way, and by no other.
    fn is_bound(&self) -> bool {
        self.missed < SILENT
    }

    /// Takes note of a hormone by another way. Returns whether it is better than those that come by the
    /// present one: it is a leader's, and so were as many before it, while by the present way none was. That
    /// may be a loop without a leader, which this module keeps alive itself.
    fn has_better(&mut self, pace: Pace) -> bool {
        if !self.is_made_good() || pace.is_made_good {
            return false;
        }
        self.stale += 1;
        self.stale > MOST_MISSED
    }

    /// Whether another rhythm that comes the same way takes the place of one that still beats: that of a
    /// new leader, or of a new place in the robot. A hormone that comes within a quarter of a beat, or that
    /// is of the last beat, may be the module's own that came back round a loop, where it would race. Its
    /// letter may be another one by then; but in a ring it has a lifetime, and does not come back. It is
    /// not its own if it is a leader's, while the last beat here was made good.
    fn succeeds(&self, pace: Pace, now: u16) -> bool {
        let is_fresher = self.is_made_good() && !pace.is_made_good;
        let is_last = pace.ahead_of(self.number) == 0 && (pace.lifetime.is_none() || pace.data == self.last);
        is_fresher || !is_last && now.wrapping_sub(self.last_at) >= self.gait.beat.get() / 4
    }

    fn take(&mut self, pace: Pace, at: u16) {
        self.last = pace.data;
        self.last_at = at;
        self.rhythm = pace.rhythm;
        self.number = pace.number;
        self.missed = 0;
        self.stale = if pace.is_made_good { self.stale.max(1) } else { 0 };
        self.is_corrected = false;
    }
}

#[cfg(test)]
mod tests;
