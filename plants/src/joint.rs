//! A joint: DC motor, planetary and external gear, friction, load, potentiometer.

pub use crate::motor::SUPPLY_VOLTS;
use crate::motor::{Motor, STOP};

/// The electrical travel of the potentiometer, in degrees, over the converter's whole range. Assumed.
pub const POTENTIOMETER_TRAVEL: f64 = 300.8;

/// The gain of the current's amplifier, in V per A. Assumed.
pub const CURRENT_VOLTS_PER_AMPERE: f64 = 1.0;

/// Full scale of the converter, in V.
pub const REFERENCE_VOLTS: f64 = 5.0;

/// A fault of a potentiometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PotentiometerFault {
    /// The wire of the wiper is broken: the converter's input is pulled to ground.
    Open,
    /// The wiper is shorted to the supply.
    ShortToSupply,
    /// The wiper stands still: its shaft slips.
    Stuck,
}

/// External influences on a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// The motor's supply, in V.
    pub supply_volts: f64,
    /// The inertia that the joint moves besides its own, in kg m².
    pub load_inertia: f64,
    /// The external torque on the joint, in Nm, towards positive angles.
    pub load_torque: f64,
    /// The friction, as a multiple of the assumed one.
    pub friction: f64,
    /// Whether something holds the joint fast.
    pub is_blocked: bool,
}

impl Default for Surroundings {
    /// A load of one module of 0.5 kg at an arm of 0.1 m, and no external torque.
    fn default() -> Self {
        Surroundings {
            supply_volts: SUPPLY_VOLTS,
            load_inertia: 0.005,
            load_torque: 0.0,
            friction: 1.0,
            is_blocked: false,
        }
    }
}

/// One joint.
#[derive(Clone, Debug)]
pub struct Joint {
    pub surroundings: Surroundings,
    pub motor: Motor,
    /// The offset of the potentiometer on its shaft, in degrees: its reading of a joint at 0.
    pub zero: f64,
    /// In rad; positive as the MCU counts.
    angle: f64,
    /// In rad/s.
    speed: f64,
    amperes: f64,
    fault: Option<(PotentiometerFault, f64)>,
}

impl Joint {
    /// A joint at rest at `degrees`.
    pub fn at(degrees: f64) -> Self {
        Joint {
            surroundings: Surroundings::default(),
            motor: Motor::default(),
            zero: 0.0,
            angle: degrees.to_radians(),
            speed: 0.0,
            amperes: 0.0,
            fault: None,
        }
    }

    /// Breaks or repairs the potentiometer.
    pub fn set_fault(&mut self, fault: Option<PotentiometerFault>) {
        self.fault = fault.map(|fault| (fault, self.potentiometer_volts()));
    }

    /// Drives the motor with `duty` of its supply, -1 to 1, for `seconds`, at most a millisecond per call.
    /// Between pulses the bridge shorts the motor, so only the mean voltage matters; a duty of 0 brakes.
    pub fn step(&mut self, duty: f64, seconds: f64) {
        let Surroundings { load_inertia, load_torque, friction, is_blocked, .. } = self.surroundings;
        self.drive(duty);
        let motor = self.motor;
        let pull = motor.torque(self.amperes) + load_torque;
        if is_blocked || (self.speed == 0.0 && pull.abs() <= motor.static_friction() * friction) {
            self.speed = 0.0;
            return;
        }
        let direction = if self.speed == 0.0 { pull.signum() } else { self.speed.signum() };
        let torque = pull - direction * motor.sliding_friction * friction;
        let speed = self.speed + torque / (motor.gear_inertia + load_inertia) * seconds;
        // Friction stops the joint; it does not turn it back.
        self.speed = if speed * direction < 0.0 { 0.0 } else { speed };
        self.angle += self.speed * seconds;
        let stop = STOP.to_radians();
        if self.angle.abs() > stop {
            self.angle = self.angle.clamp(-stop, stop);
            self.speed = 0.0;
        }
    }

    /// Drives the motor with `duty` of its supply, -1 to 1, while a world moves the joint.
    pub fn drive(&mut self, duty: f64) {
        self.amperes = self.motor.amperes(self.volts(duty), self.speed);
    }

    /// The mean voltage at the motor with `duty` of its supply, -1 to 1.
    pub fn volts(&self, duty: f64) -> f64 {
        duty.clamp(-1.0, 1.0) * self.surroundings.supply_volts
    }

    /// Sets the joint to its state in a world: an angle in rad, a speed in rad/s.
    pub fn put(&mut self, angle: f64, speed: f64) {
        self.angle = angle;
        self.speed = speed;
    }

    /// The true angle, in degrees.
    pub fn degrees(&self) -> f64 {
        self.angle.to_degrees()
    }

    /// The true speed, in degrees per second.
    pub fn degrees_per_second(&self) -> f64 {
        self.speed.to_degrees()
    }

    /// The motor's current while it is driven, in A.
    pub fn amperes(&self) -> f64 {
        self.amperes.abs()
    }

    /// The potentiometer's voltage at the converter, in V.
    pub fn potentiometer_volts(&self) -> f64 {
        match self.fault {
            None => ((self.degrees() + self.zero) / POTENTIOMETER_TRAVEL + 0.5) * REFERENCE_VOLTS,
            Some((PotentiometerFault::Open, _)) => 0.0,
            Some((PotentiometerFault::ShortToSupply, _)) => REFERENCE_VOLTS,
            Some((PotentiometerFault::Stuck, volts)) => volts,
        }
    }

    /// The voltage of the current's amplifier at the converter, in V.
    pub fn current_volts(&self) -> f64 {
        (self.amperes() * CURRENT_VOLTS_PER_AMPERE).min(REFERENCE_VOLTS)
    }
}

/// The converter's reading of a voltage: 0 to 1023.
pub fn counts(volts: f64) -> u16 {
    // The cast saturates: a negative voltage becomes 0.
    ((volts / REFERENCE_VOLTS * 1024.0) as u16).min(1023)
}

/// The voltage in the middle of those with this reading.
pub fn volts(counts: u16) -> f64 {
    (f64::from(counts) + 0.5) / 1024.0 * REFERENCE_VOLTS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motor::STALL_CURRENT;

    fn run(joint: &mut Joint, duty: f64, seconds: f64) {
        for _ in 0..(seconds * 10_000.0) as u32 {
            joint.step(duty, 1e-4);
        }
    }

    #[test]
    fn full_duty_turns_at_no_more_than_the_speed_without_load() {
        let mut joint = Joint::at(-100.0);
        run(&mut joint, 1.0, 1.0);
        let ideal = Motor::default().free_speed(SUPPLY_VOLTS).to_degrees();
        assert!((0.8 * ideal..ideal).contains(&joint.degrees_per_second()), "{joint:?}");
    }

    #[test]
    fn what_friction_leaves_of_the_torque_speeds_up_the_inertia() {
        for (duty, direction) in [(1.0, 1.0), (-1.0, -1.0)] {
            let mut joint = Joint::at(10.0);
            let Motor { stall_torque, sliding_friction, gear_inertia, .. } = joint.motor;
            joint.surroundings.load_torque = 0.3;
            joint.surroundings.friction = 2.0;
            let torque = direction * stall_torque + 0.3 - direction * 2.0 * sliding_friction;
            let speed = (torque / (gear_inertia + joint.surroundings.load_inertia) * 1e-3).to_degrees();
            joint.step(duty, 1e-3);
            assert!((joint.degrees_per_second() - speed).abs() < 1e-9, "{joint:?}");
            assert!((joint.degrees() - (10.0 + speed * 1e-3)).abs() < 1e-9, "{joint:?}");
        }
    }

    #[test]
    fn friction_stops_a_joint_and_does_not_turn_it_back() {
        for speed in [0.01, -0.01] {
            let mut joint = Joint::at(0.0);
            joint.put(0.5, speed);
            joint.step(0.0, 1e-3);
            assert_eq!((joint.degrees(), joint.degrees_per_second()), (0.5_f64.to_degrees(), 0.0));
        }
    }

    #[test]
    fn a_held_joint_draws_the_stall_current() {
        let mut joint = Joint::at(10.0);
        joint.surroundings.is_blocked = true;
        run(&mut joint, -1.0, 0.1);
        assert!((joint.amperes() - STALL_CURRENT).abs() < 1e-9);
        assert!((joint.current_volts() - STALL_CURRENT * CURRENT_VOLTS_PER_AMPERE).abs() < 1e-9);
        assert_eq!(joint.degrees(), 10.0_f64.to_radians().to_degrees());
    }

    #[test]
    fn friction_holds_what_pulls_too_little() {
        for friction in [1.0, 2.0] {
            let mut joint = Joint::at(0.0);
            joint.surroundings.friction = friction;
            joint.surroundings.load_torque = 0.9 * friction * joint.motor.static_friction();
            run(&mut joint, 0.0, 1.0);
            assert_eq!(joint.degrees(), 0.0);
            joint.surroundings.load_torque = 1.1 * friction * joint.motor.static_friction();
            run(&mut joint, 0.0, 1.0);
            assert!(joint.degrees() > 0.0);
        }
    }

    #[test]
    fn the_mechanical_stops_hold() {
        for (begin, duty, stop) in [(130.0, 1.0, STOP), (-130.0, -1.0, -STOP)] {
            let mut joint = Joint::at(begin);
            run(&mut joint, duty, 1.0);
            assert!((joint.degrees() - stop).abs() < 1e-9);
        }
    }

    #[test]
    fn the_potentiometer_reads_from_end_to_end() {
        assert_eq!(counts(Joint::at(0.0).potentiometer_volts()), 512);
        for end in [-0.5, 0.5] {
            let volts = Joint::at(end * POTENTIOMETER_TRAVEL).potentiometer_volts();
            assert!((volts - (0.5 + end) * REFERENCE_VOLTS).abs() < 1e-9, "{volts}");
        }
        let turned_on_its_shaft = Joint { zero: 10.0, ..Joint::at(20.0) };
        let [is, to_be] = [turned_on_its_shaft, Joint::at(30.0)].map(|joint| joint.potentiometer_volts());
        assert!((is - to_be).abs() < 1e-9, "{is}, not {to_be}");
        assert_eq!(counts(0.0), 0);
        assert_eq!(counts(5.0), 1023);
        assert!((0..1024).all(|reading| counts(volts(reading)) == reading));
        let mut joint = Joint::at(20.0);
        joint.set_fault(Some(PotentiometerFault::Stuck));
        let stuck = joint.potentiometer_volts();
        run(&mut joint, 1.0, 0.5);
        assert_eq!(joint.potentiometer_volts(), stuck);
        joint.set_fault(None);
        assert!(joint.potentiometer_volts() > stuck);
    }
}
