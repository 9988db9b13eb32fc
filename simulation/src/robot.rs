//! The interface of a robot, whatever simulates it.

use hormone::status::Status;

use crate::change::Change;
use crate::placing::Placing;
use crate::pose::Angles;
use crate::scenario::Event;
use crate::terminal::Transcript;
use crate::totals::{BridgeTotals, LinkTotals};
use crate::trace_event::TraceEvent;
use crate::wiring::{Face, Wiring, WiringError};
use plants::motion::Motion;
use plants::trouble::Trouble;

/// A robot that can be run.
pub trait Robot {
    /// How its modules are attached to each other now.
    fn wiring(&self) -> &Wiring;

    /// Cycles since power-up.
    fn now(&self) -> u64;

    /// When a module's power was switched on, in cycles: the robot's clock starts with the first.
    fn powered_up_at(&self, module: usize) -> u64;

    /// How long a module's programs take from its power, or from the end of a reset, until they hear, in
    /// cycles.
    fn start(&self) -> u64;

    /// Whether a module has power.
    fn is_on(&self, module: usize) -> bool;

    /// Lets something happen to the robot now.
    ///
    /// # Errors
    /// It can't happen to a robot that is wired so.
    fn change(&mut self, change: &Change) -> Result<(), WiringError>;

    /// Runs the robot up to `cycle`.
    fn run_until(&mut self, cycle: u64);

    /// Takes what the behaviours did since the last call, in order.
    fn take_trace_events(&mut self) -> Vec<TraceEvent>;

    /// Takes what the robot itself has changed of its wiring since the last call, in order.
    fn take_changes(&mut self) -> Vec<Event>;

    /// A module's view of itself; `None` while it has not begun.
    fn status(&self, module: usize) -> Option<Status>;

    /// What a module's accelerometer reads along x, y and z of the half with the Front dock, in multiples of
    /// the acceleration of gravity.
    fn acceleration(&self, module: usize) -> [f64; 3];

    /// The angles of a module's joints.
    fn angles(&self, module: usize) -> Angles;

    /// Where a module is and how it bends; `None` where there is no world.
    fn placing(&self, _module: usize) -> Option<Placing> {
        None
    }

    /// How many frames the link that begins at a dock has lost since it was attached; `None` if nothing is
    /// attached, or lost frames are not counted.
    fn lost_frames(&self, _from: Face) -> Option<u64> {
        None
    }

    /// The counts of all links.
    fn links(&self) -> LinkTotals;

    /// The counts of all bridges.
    fn bridges(&self) -> BridgeTotals;

    /// The answers of consoles, in the order in which they were asked.
    fn transcripts(&self) -> Vec<Transcript> {
        Vec::new()
    }

    /// The programs that have crashed, and why, a line each.
    fn crashes(&self) -> Vec<String> {
        Vec::new()
    }

    /// How it has moved; `None` where there is no world.
    fn motion(&self) -> Option<Motion> {
        None
    }

    /// The most that a module with two legs leaned from how the robot was laid down, in degrees; `None` where
    /// there is no world.
    fn tilt(&self) -> Option<f64> {
        None
    }

    /// The part of a full charge that the hungriest module has taken out of its battery since power-up;
    /// `None` where batteries are not simulated.
    fn charge_used(&self) -> Option<f64> {
        None
    }

    /// Why it can't go on, if so: then [`run_until`](Self::run_until) does nothing any more.
    fn trouble(&self) -> Option<&Trouble> {
        None
    }

    /// A hash of the whole state: equal runs have equal hashes.
    fn state_hash(&self) -> u64;

    /// Whether a module's view of its neighbours and of its type equals the wiring. A module without power
    /// has no view, and counts as right.
    fn is_right(&self, module: usize) -> bool {
        self.is_right_by(self.wiring(), module)
    }

    /// As [`is_right`](Self::is_right), but by this wiring.
    fn is_right_by(&self, wiring: &Wiring, module: usize) -> bool {
        !self.is_on(module)
            || self.status(module).is_some_and(|status| {
                status.neighbours() == Some(wiring.neighbours(module))
                    && status.module_type == wiring.module_type(module)
            })
    }
}
