//! All observers of a robot at once.

use crate::change::{Change, Mcus};
use crate::discovery::Discovery;
use crate::gait::Gait;
use crate::hops::Hops;
use crate::robot::Robot;

/// Follows a robot as it runs.
pub struct Observer {
    pub hops: Hops,
    pub discovery: Discovery,
    pub gait: Gait,
}

impl Observer {
    /// A robot at power-up. `period` is that of its gait, in cycles.
    pub fn new(robot: &impl Robot, period: u64) -> Self {
        let wiring = robot.wiring();
        Observer {
            hops: Hops::new(wiring.modules()),
            discovery: Discovery::new(robot),
            gait: Gait::new(wiring, period),
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
        if change.disturbs() {
            self.discovery.rewired(robot.wiring(), robot.now());
            self.gait.disturbed(robot.wiring(), robot.now());
        }
        if let Change::Reset { module, mcus: Mcus::Master | Mcus::Both } = *change {
            self.discovery.restarted(module, robot.now());
        }
    }
}
