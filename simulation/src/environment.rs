//! The surroundings that a simulated robot may have: a world with ground under it.

use std::collections::HashMap;

use crate::body::Body;
use crate::change::Change;
use crate::placing::Placing;
use crate::pose::Facing;
use crate::wiring::{Face, Wiring};
use plants::motion::Motion;
use plants::trouble::Trouble;

/// A world that a robot is in, and what passes between the two: volts at motors one way, where joints are and
/// what accelerometers feel the other.
pub trait Environment: Send {
    /// From now on the world moves a module's body, by motors that the world knows.
    fn enter(&mut self, module: usize, body: &mut Body);

    /// Takes the voltages at a module's motors in the millisecond that is over, and shows the module where
    /// its joints are and what its accelerometer reads.
    fn exchange(&mut self, module: usize, body: &mut Body);

    /// Lets a millisecond pass, unless the world has broken.
    fn step(&mut self);

    /// Has modules hold each other as `wiring` says after a change; `before` is the wiring before it.
    fn change(&mut self, change: &Change, before: &Wiring, wiring: &Wiring);

    /// The free docks that a dock looks at.
    fn facing(&self, wiring: &Wiring, from: Face) -> Vec<Facing>;

    /// By each free dock that another free one hears, the nearest of these. Both modules have power.
    fn in_sight(&self, wiring: &Wiring) -> HashMap<Face, Face>;

    /// Why the world can't go on.
    fn trouble(&self) -> Option<&Trouble>;

    /// How the robot has moved.
    fn motion(&self) -> Motion;

    /// The most that a module with two legs leaned, in degrees.
    fn tilt(&self) -> f64;

    /// Where a module is, and how it bends.
    fn placing(&self, module: usize) -> Placing;

    /// A hash of where all is and how it moves.
    fn state_hash(&self) -> u64;
}
