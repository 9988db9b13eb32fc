//! What may break at a joint.

use std::fmt;

use plants::joint::PotentiometerFault;
use serde::Deserialize;
use tasks::motor::Axis;

/// A joint of a module of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointOf {
    /// The module's index.
    pub module: usize,
    pub axis: Axis,
}

/// What is broken at a joint; a later fault of the joint replaces it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointFault {
    /// The wire of the potentiometer's wiper: it reads 0.
    Open,
    /// The wiper is shorted to the supply: it reads full scale.
    Shorted,
    /// The wiper stands still.
    Stuck,
    /// Something holds the joint fast.
    Jammed,
    /// Nothing any more.
    None,
}

impl JointFault {
    /// The fault of the potentiometer.
    pub fn of_potentiometer(self) -> Option<PotentiometerFault> {
        match self {
            JointFault::Open => Some(PotentiometerFault::Open),
            JointFault::Shorted => Some(PotentiometerFault::ShortToSupply),
            JointFault::Stuck => Some(PotentiometerFault::Stuck),
            JointFault::Jammed | JointFault::None => None,
        }
    }
}

impl fmt::Display for JointOf {
    /// As in a robot file: `3.Motor1`.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}.Motor{}", self.module, self.axis.index())
    }
}

impl fmt::Display for JointFault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            JointFault::Open => "the potentiometer's wire breaks",
            JointFault::Shorted => "the potentiometer is shorted to the supply",
            JointFault::Stuck => "the potentiometer's wiper stands still",
            JointFault::Jammed => "the joint jams",
            JointFault::None => "the joint is mended",
        })
    }
}
