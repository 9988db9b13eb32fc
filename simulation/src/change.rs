//! What can happen to a robot while it runs.

use std::fmt;

use hormone::gait::GaitName;
use hormone::hormone::Hormone;
use hormone::order::{Order, What};
use hormone::period::Period;
use hormone::standing::STOP;
use serde::Deserialize;
use tasks::router::Mcu;

use crate::wiring::{Face, Wiring, WiringError};

/// For how long a push lasts.
pub const PUSH_MILLISECONDS: u32 = 200;

/// Something that happens to a robot from outside.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Two docks are attached to each other.
    Attach(Face, Face),
    /// What is attached to a dock comes off.
    Detach(Face),
    /// Two modules change places.
    Swap(usize, usize),
    /// MCUs of a module are reset.
    Reset { module: usize, mcus: Mcus },
    /// A module's power fails. It stays where it is and attached, but is no module's neighbour any more.
    Kill(usize),
    /// Frames are lost from now on.
    Loss { links: Links, probability: f64 },
    /// Bytes are changed on their way from now on, each with this probability.
    Noise { links: Links, probability: f64 },
    /// Something bright is before a dock from now on, or is taken away: the dock hears what it sends itself.
    Obstacle { at: Face, is_there: bool },
    /// The robot lies turned about its long axis from now on, by so many degrees: its left side goes up.
    Roll(f64),
    /// A module is pushed for [a moment](crate::PUSH_MILLISECONDS), by these newtons along x, y and z of the
    /// ground.
    Push { module: usize, newtons: [f64; 3] },
    /// The potentiometers of a module's joints slip on their shafts: from now on they read so many degrees
    /// more, by the joints' indices.
    Slip { module: usize, degrees: [f64; 3] },
    /// A remote control sends a message to HORMONE, [a few times](crate::SENDS), through a dock to which
    /// nothing is attached.
    Command { at: Face, payload: Vec<u8> },
    /// A terminal at a dock to which nothing is attached asks the module's console for all that it tells.
    Console(Face),
}

/// MCUs of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mcus {
    Master,
    Slave,
    Both,
}

impl Mcus {
    pub fn contains(self, mcu: Mcu) -> bool {
        match self {
            Mcus::Both => true,
            Mcus::Master => mcu == Mcu::Master,
            Mcus::Slave => mcu == Mcu::Slave,
        }
    }
}

/// Directions of links.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Links {
    /// All, also those of later attachments.
    All,
    /// The one that begins at this dock.
    From(Face),
}

impl Change {
    /// Applies the change to the wiring. A module without power stays attached.
    ///
    /// # Errors
    /// It can't happen: a module is not there or has no power, a dock is not free or not attached, or to be
    /// attached where an obstacle is.
    pub fn apply(&self, wiring: &mut Wiring) -> Result<(), WiringError> {
        match *self {
            Change::Attach(one, other) => wiring.attach(one, other),
            Change::Detach(face) => wiring.detach(face).map(|_| ()),
            Change::Swap(one, other) => wiring.swap(one, other),
            Change::Kill(module) => wiring.kill(module),
            Change::Reset { module, .. } | Change::Push { module, .. } | Change::Slip { module, .. } => {
                wiring.check(module)
            }
            Change::Loss { links, .. } | Change::Noise { links, .. } => match links {
                Links::All => Ok(()),
                Links::From(face) => wiring.expect_attached(face),
            },
            Change::Obstacle { at, is_there } => wiring.set_obstacle(at, is_there),
            Change::Roll(_) => Ok(()),
            Change::Command { at, .. } | Change::Console(at) => wiring.expect_free(at),
        }
    }

    /// If this is an order to walk or to stop: the module through which its body is ordered, the gait's name
    /// or [`STOP`], and the Period. There may be no such gait; then the robot has to rest, too.
    pub fn orders(&self) -> Option<(usize, u8, Period)> {
        let Change::Command { at, payload } = self else { return None };
        match Hormone::from_payload(payload)? {
            Hormone::Order(Order { what: What::Walk(gait, period), .. }) => Some((at.module, gait, period)),
            _ => None,
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Change::Attach(one, other) => write!(f, "{one} and {other} are attached"),
            Change::Detach(face) => write!(f, "{face} is detached"),
            Change::Swap(one, other) => write!(f, "modules {one} and {other} change places"),
            Change::Reset { module, mcus: Mcus::Master } => {
                write!(f, "the master of module {module} is reset")
            }
            Change::Reset { module, mcus: Mcus::Slave } => write!(f, "the slave of module {module} is reset"),
            Change::Reset { module, mcus: Mcus::Both } => write!(f, "module {module} is reset"),
            Change::Kill(module) => write!(f, "the power of module {module} fails"),
            Change::Loss { links, probability } => {
                write!(f, "{} % of frames lost {links}", percent(*probability))
            }
            Change::Noise { links, probability } => {
                write!(f, "{} % of bytes changed {links}", percent(*probability))
            }
            Change::Obstacle { at, is_there: true } => write!(f, "an obstacle before {at}"),
            Change::Obstacle { at, is_there: false } => write!(f, "the obstacle before {at} is taken away"),
            Change::Roll(degrees) => write!(f, "the robot is turned to {degrees:.0} degrees"),
            Change::Push { module, newtons: [x, y, z] } => {
                write!(f, "module {module} is pushed by {x}, {y} and {z} N")
            }
            Change::Slip { module, degrees: [front, roll, back] } => {
                write!(f, "the potentiometers of module {module} slip by {front}, {roll} and {back} degrees")
            }
            Change::Console(at) => write!(f, "the console is asked at {at}"),
            Change::Command { at, .. } => match self.orders() {
                Some((_, STOP, _)) => write!(f, "an order to stop at {at}"),
                Some((_, gait, _)) => match GaitName::from_byte(gait) {
                    Some(name) => write!(f, "an order to walk by {name:?} at {at}"),
                    None => write!(f, "an order to walk by a gait that no module has at {at}"),
                },
                None => write!(f, "a message to HORMONE at {at}"),
            },
        }
    }
}

impl fmt::Display for Links {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Links::All => write!(f, "on all links"),
            Links::From(face) => write!(f, "on the link from {face}"),
        }
    }
}

/// To a thousandth.
fn percent(probability: f64) -> f64 {
    (probability * 1e5).round() / 1e3
}
