//! A joint's motor with its gears, as torque at the joint: shared by a joint alone and a joint in a world.

/// The voltage of a full duty, in V: two Li-ion cells at their nominal voltage (Salemi, Moll and Shen, 2006).
pub const SUPPLY_VOLTS: f64 = 7.4;

/// The torque at the standing joint with full duty, in Nm. From memory of SuperBot's papers, unverified.
pub const STALL_TORQUE: f64 = 6.38;

/// The current at the standing joint with full duty, in A. Assumed.
pub const STALL_CURRENT: f64 = 1.2;

/// The inertia of rotor and gear at the joint, in kg m². Assumed: 1e-7 kg m² behind a gear of 508.7.
pub const GEAR_INERTIA: f64 = 1e-7 * 508.7 * 508.7;

/// The torque of the gear's dry friction while the joint turns, in Nm. Assumed: 8 % of the stall torque.
pub const SLIDING_FRICTION: f64 = 0.08 * STALL_TORQUE;

/// The torque that breaks the standing joint loose, over that of the turning one. Assumed: half as much
/// again.
const STICTION: f64 = 1.5;

/// The angle of the joint's mechanical stops, in degrees to either side. Assumed, from "about 270 degrees".
pub const STOP: f64 = 138.0;

/// Below this speed, in rad/s, a joint counts as standing: 0.3 degrees/s. Assumed: joints of a world that are
/// held by friction creep at half of that.
const STANDING: f64 = 0.3 * std::f64::consts::PI / 180.0;

/// A motor and its gears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// The torque at the standing joint with full duty, in Nm.
    pub stall_torque: f64,
    /// The current at the standing joint with full duty, in A.
    pub stall_current: f64,
    /// The inertia of rotor and gear at the joint, in kg m².
    pub gear_inertia: f64,
    /// The torque of the gear's dry friction while the joint turns, in Nm.
    pub sliding_friction: f64,
}

impl Default for Motor {
    /// SuperBot's motor, as far as it is known.
    fn default() -> Self {
        Motor {
            stall_torque: STALL_TORQUE,
            stall_current: STALL_CURRENT,
            gear_inertia: GEAR_INERTIA,
            sliding_friction: SLIDING_FRICTION,
        }
    }
}

impl Motor {
    /// The winding's resistance, in ohms.
    fn resistance(&self) -> f64 {
        SUPPLY_VOLTS / self.stall_current
    }

    /// Torque per current at the joint, in Nm/A, which is also the voltage per speed, in V s: 80 degrees/s
    /// without load for SuperBot's.
    fn torque_constant(&self) -> f64 {
        self.stall_torque / self.stall_current
    }

    /// The braking torque of the winding on a turning joint per its speed, in Nm s. It does not depend on the
    /// voltage, since the bridge shorts the motor between pulses.
    pub fn braking(&self) -> f64 {
        self.torque_constant() * self.torque_constant() / self.resistance()
    }

    /// The joint's speed with `volts` at the motor and neither friction nor load, in rad/s.
    pub fn free_speed(&self, volts: f64) -> f64 {
        volts / self.torque_constant()
    }

    /// The motor's current with `volts` at it while the joint turns at `speed`, in rad/s. In A, with the
    /// sign of the torque.
    pub fn amperes(&self, volts: f64, speed: f64) -> f64 {
        (volts - self.torque_constant() * speed) / self.resistance()
    }

    /// The torque of a current, in Nm.
    pub fn torque(&self, amperes: f64) -> f64 {
        self.torque_constant() * amperes
    }

    /// The torque that breaks the standing joint loose, in Nm.
    pub fn static_friction(&self) -> f64 {
        STICTION * self.sliding_friction
    }

    /// The torque of dry friction, in Nm, at a joint that turns at `speed`, in rad/s. It acts against the
    /// motion.
    pub fn friction(&self, speed: f64) -> f64 {
        if speed.abs() < STANDING { self.static_friction() } else { self.sliding_friction }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braking_is_what_the_speed_takes_from_the_torque() {
        let motor = Motor::default();
        let (volts, speed) = (3.0, 0.7);
        let standing = motor.torque(motor.amperes(volts, 0.0));
        let turning = motor.torque(motor.amperes(volts, speed));
        assert!((turning - (standing - motor.braking() * speed)).abs() < 1e-12);
        assert!(motor.torque(motor.amperes(volts, motor.free_speed(volts))).abs() < 1e-12);
    }

    #[test]
    fn full_duty_stalls_with_its_torque_and_current_and_turns_at_80_degrees_a_second() {
        let motor = Motor::default();
        assert!((motor.amperes(SUPPLY_VOLTS, 0.0) - STALL_CURRENT).abs() < 1e-12);
        assert!((motor.torque(STALL_CURRENT) - STALL_TORQUE).abs() < 1e-12);
        assert!((motor.free_speed(SUPPLY_VOLTS).to_degrees() - 80.0).abs() < 0.5);
    }

    #[test]
    fn a_joint_that_stands_or_creeps_has_more_friction_than_one_that_turns() {
        let motor = Motor::default();
        let friction = |degrees_per_second: f64| motor.friction(degrees_per_second.to_radians());
        assert_eq!([0.0, 0.29, -0.29].map(friction), [motor.static_friction(); 3]);
        assert_eq!([0.31, -0.31].map(friction), [motor.sliding_friction; 2]);
        assert_eq!(motor.static_friction(), 1.5 * SLIDING_FRICTION);
    }
}
