//! Orders to the whole robot: heard, told, followed and kept.

use tasks::devices::memory::Record;
use tasks::dock::{Dock, DockSet};
use tasks::docking::latch;

use super::{ALL_DOCKS, Controller, NOTHING, OPEN_AFTER, Response, gait_named};
use crate::gait::GAITS;
use crate::hormone::Hormone;
use crate::module_type::ModuleType;
use crate::order::{Course, Order, What};
use crate::pacemaker::Pacemaker;
use crate::period::Period;
use crate::standing::{STOP, Standing};

/// After the order to become a ring, a token does not show for this long that the robot is one, in
/// milliseconds. The robot may still be a ring of which a latch is opening; half a second after the latch has
/// opened, the lost neighbour has been missed.
const CLOSED_AFTER: u16 = latch::LONGEST_MS + 500;

impl Controller {
    /// Takes in the standing order that the neighbour at `dock` told. `knows` says that the neighbour knows
    /// that this module knows it.
    #[inline(never)] // as `hear_token`
    pub(super) fn hear_of(&mut self, standing: Standing, dock: Dock, knows: bool, now: u16) -> Response {
        if !self.ledger.hear(dock, standing, knows, now) {
            return NOTHING;
        }
        let response = self.walk_by(standing, self.connected.without(DockSet::of(&[dock])), now);
        // The neighbour is to know that this module knows.
        self.ledger.hear(dock, standing, false, now);
        response
    }

    /// Takes in the order that was kept without power. It stands unless a neighbour has told a newer one.
    pub fn recall(&mut self, standing: Standing, now: u16) -> Response {
        if self.ledger.standing().number != 0 {
            return NOTHING;
        }
        let response = self.walk_by(standing, self.connected, now);
        self.ledger.kept();
        response
    }

    /// The order that is yet to be [kept](Self::kept) without power, if there is one.
    pub fn to_keep(&self) -> Option<Record> {
        self.ledger.to_keep()
    }

    /// The order has been kept.
    pub fn kept(&mut self) {
        self.ledger.kept();
    }

    /// Takes in an order from the dock `from`, or from a task of this module if that is `None`.
    pub fn order(&mut self, from: Option<Dock>, order: Order, now: u16) -> Response {
        match order.what {
            What::Walk(gait, period) => self.walk_from_now(gait, period, now),
            What::Steer(steer) => {
                if !self.helm.hear(steer, order.serial, now) {
                    return self.dropped();
                }
                let mut docks = ALL_DOCKS;
                if let Some(from) = from {
                    docks.remove(from);
                }
                match self.helm.onward(now) {
                    Some(order) => self.send(Hormone::Order(order), docks),
                    None => NOTHING,
                }
            }
        }
    }

    /// Orders the whole robot to walk by this gait.
    pub(super) fn walk_from_now(&mut self, gait: u8, period: Period, now: u16) -> Response {
        match self.ledger.standing().next(gait, period) {
            Some(standing) => self.walk_by(standing, self.connected, now),
            None => NOTHING,
        }
    }

    /// Makes this the standing order, and has these neighbours told. A module that walks so already goes on;
    /// another one rests until its leader's beat comes.
    #[inline(never)] // as `hear_token`
    fn walk_by(&mut self, standing: Standing, tell: DockSet, now: u16) -> Response {
        let is_halted = self.is_halted();
        self.ledger.set(standing, tell, now);
        if self.is_halted() {
            if standing.gait != STOP {
                // Other modules may know the gait.
                let _ = self.dropped();
            }
            self.pacemaker.forget();
            self.reshaped_at = None;
            return self.rest();
        }
        let Some(gait) = gait_named(standing.gait) else { return NOTHING };
        let gait = standing.period.of(gait);
        if !is_halted && (gait.name, gait.beat) == (self.gait().name, self.gait().beat) {
            return NOTHING;
        }
        self.status.gait = gait.name;
        self.rhythm = self.rhythm.wrapping_add(1);
        self.pacemaker = Pacemaker::new(gait, now);
        self.reshaped_at = gait.once.map(|once| match once.becomes {
            ModuleType::Spine => now.wrapping_add(CLOSED_AFTER),
            _ => now.wrapping_add(OPEN_AFTER),
        });
        self.rest()
    }

    /// Whether the robot was ordered to stop, or to walk by a gait that this program does not have.
    pub fn is_halted(&self) -> bool {
        self.ledger.standing().gait.wrapping_sub(1) >= GAITS.len() as u8
    }

    /// Where the robot is to go.
    pub fn course(&self) -> Course {
        self.helm.course()
    }
}
