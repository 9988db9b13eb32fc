//! The standing order: by which gait the robot walks, and in which Period, until a newer order comes.
//!
//! Every module keeps it, and the robot numbers its orders. A module tells the order to each neighbour that
//! appears, to the one that its beats come from where that may be another, and to all when a newer one comes,
//! again and again until the neighbour says that it knows. So a module that was reset, or is attached anew,
//! learns it before its first beat, and no loss on the way leaves a part of the robot behind. Where two
//! robots become one, the newer order wins.
//!
//! A module also has its order kept without power. What it recalls when it starts is older than any order that
//! was given while the robot had power: so it counts where all were reset.

use tasks::devices::memory::Record;
use tasks::dock::{Dock, DockSet};

use crate::gait::GAITS;
use crate::period::Period;
use crate::time::{reached, until};

/// The gait's name of an order to stop.
pub const STOP: u8 = 0;

/// The bit of a number that lifts orders given since power-up above those that were recalled.
const GIVEN: u16 = 0x8000;

/// By so much an order to stop counts.
const STOPS: u16 = 16;

/// How long a neighbour that has not answered is waited for before it is told again, in milliseconds: longer
/// than a link repeats a message, and long enough for probes to go out between two of them.
const PATIENCE: u16 = 200;

/// An order as modules keep it.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Standing {
    /// Counts the robot's orders in bits 14..0, modulo 32768; bit 15 is that of an order that was given since
    /// power-up. 0 before the first.
    pub number: u16,
    /// The gait, by [name](crate::gait::Gait::name), or [`STOP`].
    pub gait: u8,
    /// In which Period.
    pub period: Period,
}

impl Standing {
    /// What stands at power-up.
    pub const fn none(gait: u8) -> Self {
        Standing { number: 0, gait, period: Period::OWN }
    }

    /// The order after this one, or `None` where it was given already and stands. To stop counts as several:
    /// it is to win over orders that were given at the same time elsewhere in the robot.
    pub fn next(self, gait: u8, period: Period) -> Option<Self> {
        if self.is_given() && (self.gait, self.period) == (gait, period) {
            return None;
        }
        let step = if gait == STOP { STOPS } else { 1 };
        let count = (self.number.wrapping_add(step) & !GIVEN).max(1);
        Some(Standing { number: count | GIVEN, gait, period })
    }

    /// Whether it was given since power-up.
    fn is_given(self) -> bool {
        self.number & GIVEN != 0
    }

    /// What is kept of it without power.
    pub fn to_record(self) -> Record {
        let [low, high] = (self.number & !GIVEN).to_le_bytes();
        [self.gait, low, high, self.period.to_byte()]
    }

    /// What was kept, if that is an order by a gait of this program's.
    pub fn from_record([gait, low, high, period]: Record) -> Option<Self> {
        let number = u16::from_le_bytes([low, high]);
        let is_known = gait == STOP || usize::from(gait) <= GAITS.len();
        let period = Period::from_byte(period)?;
        (is_known && number != 0 && number < GIVEN).then_some(Standing { number, gait, period })
    }

    /// Whether a module goes over from the other order to this one. Of two with one number, as they can be
    /// where two robots become one, one has to win: to stop, or else whichever.
    pub fn supersedes(self, other: Standing) -> bool {
        if self.number == other.number {
            return self.number != 0 && self.rank() > other.rank();
        }
        if self.is_given() != other.is_given() {
            return self.is_given();
        }
        // What stands at power-up is older than any order. Of two that are as far apart as can be, either
        // could be the newer.
        let ahead = self.number.wrapping_sub(other.number) & !GIVEN;
        let is_newer = ahead < GIVEN / 2 || ahead == GIVEN / 2 && self.number > other.number;
        other.number == 0 || self.number != 0 && is_newer
    }

    fn rank(self) -> u16 {
        u16::from_be_bytes([self.gait.wrapping_sub(STOP + 1), self.period.to_byte()])
    }
}

/// What a module knows of the standing order, and who of its neighbours may not know it.
pub struct Ledger {
    standing: Standing,
    /// Whether it has been kept without power.
    is_kept: bool,
    /// These have not said that they know it.
    untold: DockSet,
    /// These have said it, and wait for an answer.
    unanswered: DockSet,
    /// When those that are untold are told again.
    tell_at: u16,
}

impl Ledger {
    /// A module at power-up, which begins with this gait.
    pub const fn new(gait: u8) -> Self {
        Ledger {
            standing: Standing::none(gait),
            is_kept: true,
            untold: DockSet::EMPTY,
            unanswered: DockSet::EMPTY,
            tell_at: 0,
        }
    }

    /// What stands.
    pub fn standing(&self) -> Standing {
        self.standing
    }

    /// This order stands from now on; all of `docks` are to know it.
    pub fn set(&mut self, standing: Standing, docks: DockSet, now: u16) {
        self.standing = standing;
        self.is_kept = false;
        self.untold = DockSet::EMPTY;
        self.unanswered = DockSet::EMPTY;
        self.tell(docks, now);
    }

    /// What is to be kept without power, until it [is](Self::kept).
    pub fn to_keep(&self) -> Option<Record> {
        (!self.is_kept).then(|| self.standing.to_record())
    }

    /// What stands is kept.
    pub fn kept(&mut self) {
        self.is_kept = true;
    }

    /// These neighbours may not know what stands.
    pub fn tell(&mut self, docks: DockSet, now: u16) {
        if !docks.is_empty() {
            self.untold = self.untold.union(docks);
            self.tell_at = now;
        }
    }

    /// The neighbour at `dock` says what stands with it, and whether it knows that this module knows as much.
    /// Returns whether it is news, for [`set`](Self::set).
    pub fn hear(&mut self, dock: Dock, theirs: Standing, knows: bool, now: u16) -> bool {
        let is_old = theirs.number == 0 && self.standing.number == 0;
        if theirs == self.standing || is_old {
            self.untold.remove(dock);
            if !knows {
                self.unanswered.insert(dock);
            }
            return false;
        }
        let is_news = theirs.supersedes(self.standing);
        if !is_news {
            self.tell(DockSet::of(&[dock]), now);
        }
        is_news
    }

    /// The neighbours to tell at `now`, of `connected`, and whether these are known to know it.
    #[inline] // mostly there is nothing to tell
    pub fn due(&mut self, connected: DockSet, now: u16) -> Option<(DockSet, bool)> {
        if self.untold.is_empty() && self.unanswered.is_empty() {
            return None;
        }
        self.untold = self.untold.intersection(connected);
        if !self.untold.is_empty() && reached(self.tell_at, now) {
            self.tell_at = now.wrapping_add(PATIENCE);
            return Some((self.untold, false));
        }
        let unanswered = core::mem::take(&mut self.unanswered).intersection(connected);
        (!unanswered.is_empty()).then_some((unanswered, true))
    }

    /// Milliseconds from `now` until [`due`](Self::due) is to be called; `None` while all know what stands.
    pub fn next_due(&self, now: u16) -> Option<u16> {
        if !self.unanswered.is_empty() {
            return Some(0);
        }
        (!self.untold.is_empty()).then(|| until(self.tell_at, now))
    }
}

#[cfg(test)]
mod tests;
