//! What can happen to a robot while it runs.

use std::fmt;

use hormone::gait::GaitName;
use hormone::hormone::Hormone;
use hormone::order::{Order, What};
use hormone::period::Period;
use hormone::standing::STOP;
use serde::Deserialize;
use tasks::router::Mcu;

use crate::fault::{JointFault, JointOf};
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
    /// From now on the two docks of each link share one light, or no longer do: each USART hears what it
    /// sends itself, and where both docks send at once, each hears both.
    SharedLight(bool),
    /// The robot lies turned about its long axis from now on, by so many degrees: its left side goes up.
    Roll(f64),
    /// A module is pushed for [a moment](crate::PUSH_MILLISECONDS), by these newtons along x, y and z of the
    /// ground.
    Push { module: usize, newtons: [f64; 3] },
    /// The potentiometers of a module's joints slip on their shafts: from now on they read so many degrees
    /// more, by the joints' indices.
    Slip { module: usize, degrees: [f64; 3] },
    /// A joint breaks, or is mended.
    Fault { joint: JointOf, fault: JointFault },
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
            Change::Fault { joint, .. } => wiring.check(joint.module),
            Change::Loss { links, .. } | Change::Noise { links, .. } => match links {
                Links::All => Ok(()),
                Links::From(face) => wiring.expect_attached(face),
            },
            Change::Obstacle { at, is_there } => wiring.set_obstacle(at, is_there),
            Change::SharedLight(is_shared) => {
                wiring.share_light(is_shared);
                Ok(())
            }
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
            Change::SharedLight(true) => write!(f, "docks of a link share one light"),
            Change::SharedLight(false) => write!(f, "docks of a link have a light each"),
            Change::Roll(degrees) => write!(f, "the robot is turned to {degrees} degrees"),
            Change::Push { module, newtons: [x, y, z] } => {
                write!(f, "module {module} is pushed by {x}, {y} and {z} N")
            }
            Change::Slip { module, degrees: [front, roll, back] } => {
                write!(f, "the potentiometers of module {module} slip by {front}, {roll} and {back} degrees")
            }
            Change::Fault { joint, fault } => write!(f, "{fault} at {joint}"),
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

#[cfg(test)]
mod tests {
    use tasks::dock::Dock;
    use tasks::motor::Axis;

    use super::*;

    #[test]
    fn each_change_is_told_in_words() {
        let [one, other] = [(1, Dock::Back), (2, Dock::Front)].map(|(module, dock)| Face { module, dock });
        let order = |gait: u8, period| Change::Command { at: one, payload: vec![0xd0 + gait, 7, period] };
        let loss = |probability| Change::Loss { links: Links::All, probability };
        let reset = |mcus| Change::Reset { module: 3, mcus };
        let joint = JointOf { module: 3, axis: Axis::Roll };
        let fault = |fault| Change::Fault { joint, fault };
        for (change, words) in [
            (Change::Attach(one, other), "1.Back and 2.Front are attached"),
            (Change::Detach(one), "1.Back is detached"),
            (Change::Swap(4, 3), "modules 4 and 3 change places"),
            (reset(Mcus::Master), "the master of module 3 is reset"),
            (reset(Mcus::Slave), "the slave of module 3 is reset"),
            (reset(Mcus::Both), "module 3 is reset"),
            (Change::Kill(3), "the power of module 3 fails"),
            (loss(0.0), "0 % of frames lost on all links"),
            (loss(0.07), "7 % of frames lost on all links"),
            (loss(1.0), "100 % of frames lost on all links"),
            (loss(1.0 / 3.0), "33.333 % of frames lost on all links"),
            (loss(0.000_016), "0.002 % of frames lost on all links"),
            (
                Change::Noise { links: Links::From(one), probability: 0.005 },
                "0.5 % of bytes changed on the link from 1.Back",
            ),
            (Change::Obstacle { at: one, is_there: true }, "an obstacle before 1.Back"),
            (Change::Obstacle { at: one, is_there: false }, "the obstacle before 1.Back is taken away"),
            (Change::SharedLight(true), "docks of a link share one light"),
            (Change::SharedLight(false), "docks of a link have a light each"),
            (Change::Roll(-180.0), "the robot is turned to -180 degrees"),
            (Change::Roll(22.5), "the robot is turned to 22.5 degrees"),
            (
                Change::Push { module: 3, newtons: [0.0, -12.5, 3.0] },
                "module 3 is pushed by 0, -12.5 and 3 N",
            ),
            (
                Change::Slip { module: 3, degrees: [1.5, 0.0, -2.0] },
                "the potentiometers of module 3 slip by 1.5, 0 and -2 degrees",
            ),
            (fault(JointFault::Open), "the potentiometer's wire breaks at 3.Motor1"),
            (fault(JointFault::Shorted), "the potentiometer is shorted to the supply at 3.Motor1"),
            (fault(JointFault::Stuck), "the potentiometer's wiper stands still at 3.Motor1"),
            (fault(JointFault::Jammed), "the joint jams at 3.Motor1"),
            (fault(JointFault::None), "the joint is mended at 3.Motor1"),
            (Change::Console(one), "the console is asked at 1.Back"),
            (order(0, 255), "an order to stop at 1.Back"),
            (order(2, 20), "an order to walk by Caterpillar at 1.Back"),
            (order(11, 255), "an order to walk by a gait that no module has at 1.Back"),
            // No order has this Period.
            (order(2, 3), "a message to HORMONE at 1.Back"),
            (Change::Command { at: one, payload: vec![0xe1, 7, 3] }, "a message to HORMONE at 1.Back"),
        ] {
            assert_eq!(change.to_string(), words);
        }
    }

    #[test]
    fn a_reset_of_both_mcus_resets_each() {
        for (mcus, master, slave) in
            [(Mcus::Master, true, false), (Mcus::Slave, false, true), (Mcus::Both, true, true)]
        {
            assert_eq!([Mcu::Master, Mcu::Slave].map(|mcu| mcus.contains(mcu)), [master, slave], "{mcus:?}");
        }
    }

    /// The module through which the order comes, the gait and the Period; `None` for what is no order.
    #[test]
    fn an_order_is_one_to_walk_or_to_stop() {
        let at = Face { module: 3, dock: Dock::Up };
        let of = Period::of_milliseconds;
        for (payload, ordered) in [
            (&[0xd0, 1, 255][..], Some((STOP, Some(Period::OWN)))),
            (&[0xd2, 9, 80], Some((2, of(4_000)))),
            (&[0xdb, 9, 5], Some((11, of(250)))),
            (&[0xdb, 9, 4], None),
            (&[0xdc, 9, 5], None),
            (&[0xe1, 1, 20], None),
            (&[1, 0], None),
            (&[], None),
        ] {
            let change = Change::Command { at, payload: payload.to_vec() };
            let ordered = ordered.map(|(gait, period)| (3, gait, period.unwrap()));
            assert_eq!(change.orders(), ordered, "{payload:?}");
        }
        assert_eq!(Change::Console(at).orders(), None);
    }
}
