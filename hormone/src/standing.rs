//! The standing order: by which gait the robot walks, and in which Period, until a newer order comes.
//!
//! Every module keeps it, and the robot numbers its orders. A module tells the order to each neighbour that
//! appears, to the one that its beats come from when another may have taken its place, and to all when a
//! newer order comes. It repeats the order until the neighbour says that it knows it. So a module that was
//! reset, or is attached anew, learns it before its first beat, and no loss on the way leaves a part of the
//! robot behind. Where two robots become one, the newer order wins.
//!
//! A module also has its order kept without power. The order that it recalls when it starts counts as older
//! than any that was given since power-up, so it prevails only where all modules were reset.

use tasks::devices::memory::Record;
use tasks::dock::{Dock, DockSet};

use crate::gait::GAITS;
use crate::period::Period;
use crate::time::{reached, until};

/// The gait's name of an order to stop.
pub const STOP: u8 = 0;

/// The bit of a number that lifts orders given since power-up above those that were recalled.
const GIVEN: u16 = 0x8000;

/// By how much an order to stop raises the number.
const STOPS: u16 = 16;

/// How long a module waits for a neighbour's answer before it tells the order again, in milliseconds: longer
/// than a link repeats a message, and long enough for probes to go out between two messages.
const PATIENCE: u16 = 200;

/// An order as modules keep it.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Standing {
    /// Counts the robot's orders in bits 14..0, modulo 32768; bit 15 is set in an order that was given since
    /// power-up. 0 before the first order.
    pub number: u16,
    /// The gait, by [name](crate::gait::Gait::name), or [`STOP`].
    pub gait: u8,
    /// In which Period.
    pub period: Period,
}

impl Standing {
    /// The standing order at power-up.
    pub const fn none(gait: u8) -> Self {
        Standing { number: 0, gait, period: Period::OWN }
    }

    /// The order after this one, or `None` if the same order was given already and stands. An order to stop
    /// counts as several, so that it wins over orders that were given at the same time elsewhere in the
    /// robot.
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

    /// The record of it that is kept without power.
    pub fn to_record(self) -> Record {
        let [low, high] = (self.number & !GIVEN).to_le_bytes();
        [self.gait, low, high, self.period.to_byte()]
    }

    /// The order that was kept, if its gait is one of this program's or it is an order to stop.
    pub fn from_record([gait, low, high, period]: Record) -> Option<Self> {
        let number = u16::from_le_bytes([low, high]);
        let is_known = gait == STOP || usize::from(gait) <= GAITS.len();
        let period = Period::from_byte(period)?;
        (is_known && number != 0 && number < GIVEN).then_some(Standing { number, gait, period })
    }

    /// Whether a module changes from the other order to this one. Where two robots become one, two orders can
    /// have the same number, and one of them has to win: an order to stop, or else either one.
    pub fn supersedes(self, other: Standing) -> bool {
        if self.number == other.number {
            return self.number != 0 && self.rank() > other.rank();
        }
        if self.is_given() != other.is_given() {
            return self.is_given();
        }
        // The order that stands at power-up is older than any that was given. Of two numbers as far apart as
        // can be, either could be the newer.
        let ahead = self.number.wrapping_sub(other.number) & !GIVEN;
        let is_newer = ahead < GIVEN / 2 || ahead == GIVEN / 2 && self.number > other.number;
        other.number == 0 || self.number != 0 && is_newer
    }

    fn rank(self) -> u16 {
        u16::from_be_bytes([self.gait.wrapping_sub(STOP + 1), self.period.to_byte()])
    }
}

/// What a module knows of the standing order, and which of its neighbours may not know it.
pub struct Ledger {
    standing: Standing,
    /// Whether it has been kept without power.
    is_kept: bool,
    /// Neighbours that have not said that they know it.
    untold: DockSet,
    /// Neighbours that have said so, and wait for an answer.
    unanswered: DockSet,
    /// When the untold neighbours are told again.
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

    /// The standing order.
    pub fn standing(&self) -> Standing {
        self.standing
    }

    /// Makes this the standing order, to be told to all of `docks`.
    pub fn set(&mut self, standing: Standing, docks: DockSet, now: u16) {
        self.standing = standing;
        self.is_kept = false;
        self.untold = DockSet::EMPTY;
        self.unanswered = DockSet::EMPTY;
        self.tell(docks, now);
    }

    /// The record that is yet to be [kept](Self::kept) without power, if there is one.
    pub fn to_keep(&self) -> Option<Record> {
        (!self.is_kept).then(|| self.standing.to_record())
    }

    /// The standing order has been kept.
    pub fn kept(&mut self) {
        self.is_kept = true;
    }

    /// Has these neighbours told the standing order: they may not know it.
    pub fn tell(&mut self, docks: DockSet, now: u16) {
        if !docks.is_empty() {
            self.untold = self.untold.union(docks);
            self.tell_at = now;
        }
    }

    /// Takes in the standing order of the neighbour at `dock`. `knows` says that the neighbour knows that
    /// this module knows it. Returns whether it is news, for [`set`](Self::set).
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

    /// The neighbours among `connected` to tell at `now`, and whether they are known to know the order.
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
