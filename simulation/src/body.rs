//! The body of a module: joints, latches and battery, whatever drives them.

use plants::battery::{Battery, IDLE_AMPERES};
use plants::dock::Latch;
use plants::joint::{Joint, volts};
use plants::motor::Motor;
use tasks::dock::{Dock, DockSet};
use tasks::docking::latch::{End, EndSwitches};
use tasks::motor::Axis;
use tasks::motor::joint::Reading;
use tasks::superbot::{MASTER, SLAVE};

use crate::fault::JointFault;
use crate::hooks::Hooks;
use crate::noise::Noise;
use crate::pose::Angles;

/// Steps of a joint's equations in one step of the body, if no world moves it.
const PARTS: u32 = 2;

/// The docks of the master's half, then those of the slave's.
const HALVES: [[Dock; 3]; 2] = [MASTER.docks(), SLAVE.docks()];

/// A module's body, to be looked at and interfered with between runs.
#[derive(Clone, Debug)]
pub struct Body {
    joints: [Joint; 3],
    /// `None` unless a world moves the joints.
    driven: Option<Driven>,
    latches: [Latch; 6],
    /// Docks whose motors have moved their latches to an end, and to which.
    arrivals: Vec<(Dock, End)>,
    /// The current out of each dock while its power switch is closed, in A. A current into it reaches the
    /// battery by its charger.
    pub dock_amperes: [f64; 6],
    /// The light of each dock that something other than a dock of the robot reflects, in counts of the
    /// converter.
    pub proximity: [u16; 6],
    /// The light of each dock that other docks of the robot reflect, in counts of the converter.
    reflected: [u16; 6],
    pub battery: Battery,
    /// The temperatures of both boards, in degrees Celsius.
    pub celsius: [f64; 2],
    /// What the accelerometer reads along x, y and z of the half with the Front dock, in multiples of the
    /// acceleration of gravity.
    pub acceleration: [f64; 3],
    /// That of the converters that measure it.
    noise: Noise,
    hooks: Hooks,
}

/// The drives that the MCUs give to motors and switches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drives {
    /// The duties of the joints' motors, -1 to 1, by the joints' indices.
    pub duties: [f64; 3],
    /// Where docking motors drive their latches, by docks: 1 to latched, -1 to released, 0 is off.
    pub latches: [i8; 6],
    /// The docks whose power switches are closed.
    pub closed: DockSet,
    pub is_charging: bool,
}

/// The voltages at the motors of a body since the world last asked.
#[derive(Clone, Copy, Debug, Default)]
struct Driven {
    /// The sum over the steps, in V.
    volts: [f64; 3],
    steps: u32,
}

impl Default for Body {
    /// A module that lies still, straight and released from all others, with a full battery.
    fn default() -> Self {
        Body {
            joints: [0.0; 3].map(Joint::at),
            driven: None,
            latches: [0.0; 6].map(Latch::at),
            arrivals: Vec::new(),
            dock_amperes: [0.0; 6],
            proximity: [0; 6],
            reflected: [0; 6],
            battery: Battery::at_power_up(),
            celsius: [25.0; 2],
            acceleration: [0.0, 0.0, 1.0],
            noise: Noise::default(),
            hooks: Hooks::default(),
        }
    }
}

impl Body {
    pub fn joint(&self, axis: Axis) -> &Joint {
        &self.joints[usize::from(axis.index())]
    }

    pub fn joint_mut(&mut self, axis: Axis) -> &mut Joint {
        &mut self.joints[usize::from(axis.index())]
    }

    pub fn latch(&self, dock: Dock) -> &Latch {
        &self.latches[usize::from(dock.index())]
    }

    pub fn latch_mut(&mut self, dock: Dock) -> &mut Latch {
        &mut self.latches[usize::from(dock.index())]
    }

    /// The switches at the ends of a dock's latch.
    pub fn end_switches(&self, dock: Dock) -> EndSwitches {
        let latch = self.latch(dock);
        EndSwitches { is_released: latch.is_released(), is_latched: latch.is_latched() }
    }

    /// The angles of the joints.
    pub fn angles(&self) -> Angles {
        self.joints.each_ref().map(Joint::degrees)
    }

    /// Gives all joints this motor, and potentiometers that sit turned on their shafts by so many degrees;
    /// the converters that measure it so much noise; and all latches these hooks.
    pub fn equip(&mut self, motor: Motor, zeros: [f64; 3], noise: Noise, hooks: Hooks) {
        (self.noise, self.hooks) = (noise, hooks);
        for (joint, zero) in self.joints.iter_mut().zip(zeros) {
            joint.motor = motor;
            joint.zero = zero;
        }
    }

    /// Potentiometers slip on their shafts, by so many degrees.
    pub fn slip(&mut self, degrees: [f64; 3]) {
        for (joint, slip) in self.joints.iter_mut().zip(degrees) {
            joint.zero += slip;
        }
    }

    /// Breaks a joint, or mends it.
    pub fn break_joint(&mut self, axis: Axis, fault: JointFault) {
        let joint = self.joint_mut(axis);
        joint.set_fault(fault.of_potentiometer());
        joint.surroundings.is_blocked = fault == JointFault::Jammed;
    }

    /// From now on a world moves the joints. Returns the mean voltage at each motor since it last asked, in
    /// V.
    pub fn take_volts(&mut self) -> [f64; 3] {
        let Driven { volts, steps } = self.driven.replace(Driven::default()).unwrap_or_default();
        volts.map(|sum| sum / f64::from(steps.max(1)))
    }

    /// Brings the joints to where a world has them, in rad and rad/s, and shows the accelerometer what it has
    /// to feel, in multiples of the acceleration of gravity.
    pub fn put(&mut self, angles: [f64; 3], speeds: [f64; 3], acceleration: [f64; 3]) {
        for ((joint, angle), speed) in self.joints.iter_mut().zip(angles).zip(speeds) {
            joint.put(angle, speed);
        }
        self.acceleration = acceleration;
    }

    /// As much noise as its converters have, for one of them.
    pub fn noise(&mut self) -> Noise {
        self.noise.another()
    }

    /// The converter's readings of a joint.
    pub fn reading(&mut self, axis: Axis) -> Reading {
        let joint = self.joint(axis);
        let (potentiometer, current) = (joint.potentiometer_volts(), joint.current_volts());
        Reading { potentiometer: self.noise.read(potentiometer), current: self.noise.read(current) }
    }

    /// Sets how much of a dock's light other docks of the robot reflect, in counts of the converter.
    pub fn reflect(&mut self, dock: Dock, counts: u16) {
        self.reflected[usize::from(dock.index())] = counts;
    }

    /// How much of its own light a dock sees reflected, in counts of the converter.
    pub fn reflected(&self, dock: Dock) -> u16 {
        let index = usize::from(dock.index());
        self.proximity[index].max(self.reflected[index])
    }

    /// The same as the voltage at its converter.
    pub fn light_volts(&self, dock: Dock) -> f64 {
        volts(self.reflected(dock))
    }

    /// The same as its converter reads it.
    pub fn light_reading(&mut self, dock: Dock) -> u16 {
        self.noise.read(self.light_volts(dock))
    }

    /// Whether a latch has come to an end by its own motor since they were last taken.
    pub fn has_arrived(&self) -> bool {
        !self.arrivals.is_empty()
    }

    /// Takes the latches that have come to an end by their own motors since the last call.
    pub fn take_arrivals(&mut self) -> Vec<(Dock, End)> {
        std::mem::take(&mut self.arrivals)
    }

    /// Whether the hooks of a latch that closes take hold of a dock that they reach.
    pub fn takes_hold(&mut self) -> bool {
        self.hooks.take_hold()
    }

    /// Sets a latch that another motor than its own, or the builder of the robot, has moved.
    pub fn set_latch(&mut self, dock: Dock, end: End) {
        *self.latch_mut(dock) = Latch::at(if end == End::Latched { 1.0 } else { 0.0 });
    }

    /// Lets so much time pass, a millisecond at most.
    pub fn step(&mut self, drives: &Drives, seconds: f64) {
        let volts = self.battery.volts();
        let mut amperes = IDLE_AMPERES;
        for (index, joint) in self.joints.iter_mut().enumerate() {
            let duty = drives.duties[index];
            joint.surroundings.supply_volts = volts;
            match &mut self.driven {
                None => (0..PARTS).for_each(|_| joint.step(duty, seconds / f64::from(PARTS))),
                Some(driven) => {
                    joint.drive(duty);
                    driven.volts[index] += joint.volts(duty);
                }
            }
            amperes += joint.amperes() * duty.abs();
        }
        if let Some(driven) = &mut self.driven {
            driven.steps += 1;
        }
        for dock in HALVES.into_iter().flatten() {
            let index = usize::from(dock.index());
            let direction = drives.latches[index];
            let latch = &mut self.latches[index];
            let before = (direction != 0).then(|| end_of(latch));
            latch.step(direction, seconds);
            amperes += latch.amperes();
            if before.is_some_and(|before| end_of(latch) != before) {
                self.arrivals.extend(end_of(latch).map(|end| (dock, end)));
            }
            if drives.closed.contains(dock) {
                let outward = self.dock_amperes[index];
                amperes += if drives.is_charging { outward } else { outward.max(0.0) };
            }
        }
        self.battery.step(amperes, seconds);
    }
}

/// The end at which a latch presses its switch.
fn end_of(latch: &Latch) -> Option<End> {
    match (latch.is_released(), latch.is_latched()) {
        (true, _) => Some(End::Released),
        (_, true) => Some(End::Latched),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use plants::battery::CAPACITY;
    use plants::motor::{STALL_CURRENT, SUPPLY_VOLTS};

    use super::*;

    /// In s.
    const STEP: f64 = 0.25e-3;

    #[test]
    fn the_battery_gives_what_electronics_motors_latches_and_neighbours_draw() {
        let mut body = Body::default();
        body.joint_mut(Axis::Roll).surroundings.is_blocked = true;
        body.dock_amperes = [0.0, 0.3, -0.4, 0.0, 0.0, 0.0];
        let mut drives = Drives { duties: [0.0, -0.5, 0.0], ..Drives::default() };
        drives.latches[usize::from(Dock::Front.index())] = 1;
        for dock in [Dock::Back, Dock::Left] {
            drives.closed.insert(dock);
        }
        let mut coulombs = 0.0;
        for step in 0..4000 {
            // For half of the time the bridge connects the battery to the motor, whose mean voltage is half.
            let motor = 0.5 * 0.5 * STALL_CURRENT * body.battery.volts() / SUPPLY_VOLTS;
            // A latch is at its end after 0.8 s, and its motor stalls there.
            let latch = if f64::from(step) * STEP < 0.8 - STEP / 2.0 { 0.2 } else { 0.9 };
            // What comes in by a dock charges the battery only by the charger.
            drives.is_charging = step >= 2000;
            let neighbours = if drives.is_charging { 0.3 - 0.4 } else { 0.3 };
            coulombs += (IDLE_AMPERES + motor + latch + neighbours) * STEP;
            body.step(&drives, STEP);
        }
        let used = body.battery.used() * CAPACITY;
        assert!((used - coulombs).abs() < 1e-3 * coulombs, "{used} C, not {coulombs} C");
        assert_eq!(body.latch(Dock::Front).way(), 1.0);
    }
}
