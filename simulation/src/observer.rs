//! All observers of a robot at once.

use crate::change::{Change, Links, Mcus};
use crate::discovery::Discovery;
use crate::gait::Gait;
use crate::hops::Hops;
use crate::robot::Robot;
use crate::wiring::{Face, Wiring};

/// Follows a robot as it runs.
pub struct Observer {
    pub hops: Hops,
    pub discovery: Discovery,
    pub gait: Gait,
    /// Docks from which nothing comes through, though something is attached there.
    muted: Vec<Face>,
    /// The attachments that modules can find out: none where one end is blind.
    wiring: Wiring,
}

impl Observer {
    /// A robot at power-up. `period` is that of its gait, in cycles.
    pub fn new(robot: &impl Robot, period: u64) -> Self {
        let wiring = robot.wiring();
        Observer {
            hops: Hops::new(wiring.modules()),
            discovery: Discovery::new(robot),
            gait: Gait::new(wiring, period),
            muted: Vec::new(),
            wiring: wiring.clone(),
        }
    }

    /// Looks at what the robot has done since the last call.
    pub fn look(&mut self, robot: &mut impl Robot) {
        for deed in robot.take_deeds() {
            self.hops.take(&deed, robot.wiring());
            self.discovery.take(&deed);
            self.gait.take(&deed);
        }
        self.discovery.look(robot);
        self.gait.pass(robot.now());
    }

    /// Something has just happened to the robot.
    pub fn changed(&mut self, robot: &impl Robot, change: &Change) {
        if let Change::Loss { links, probability } = *change {
            self.muted.retain(|&face| links != Links::All && links != Links::From(face));
            if probability >= 1.0 {
                match links {
                    Links::All => self.muted.extend(robot.wiring().attached()),
                    Links::From(face) => self.muted.push(face),
                }
            }
            if links == Links::All {
                self.gait.loses(probability, robot.now());
            }
        }
        let wiring = self.audible(robot.wiring());
        if change.disturbs() || wiring != self.wiring {
            self.discovery.rewired(&wiring, robot.now());
            self.gait.disturbed(&wiring, robot.now());
            self.wiring = wiring;
        }
        if let Change::Reset { module, mcus: Mcus::Master | Mcus::Both } = *change {
            self.discovery.restarted(module, robot.now());
        }
    }

    /// A wiring without the attachments that are blind in one direction: neither end counts the other then.
    fn audible(&self, wiring: &Wiring) -> Wiring {
        let mut audible = wiring.clone();
        for &face in &self.muted {
            // Nothing is attached there any more: then nothing is to be detached.
            let _ = audible.detach(face);
        }
        audible
    }
}
