//! The assumptions about the bodies and the ground, none of which are published. Those about motors and gears
//! are in [`plants::motor`].

use plants::motor::Motor;

/// The mass of a module, in kg. The parts of the laboratory's simulator (ReMod3D) add up to 1.109 kg.
/// Assumed: 0.5 kg a half, spread evenly over its box.
pub const MODULE_MASS: f64 = 1.0;

/// The friction between a module and the ground: aluminium and plastic on a floor. Assumed.
pub const FRICTION: f64 = 0.7;

/// The distance of the shell behind the face of a dock, in mm, so that modules side by side do not rub.
/// Assumed.
pub const SHELL: f64 = 1.0;

/// The distance of the part at the roll behind the shell of the halves, in mm. Assumed.
pub const SLIMMER: f64 = 1.0;

/// The time constant of contacts with the ground and of docks, in s: as stiff as is stable with steps of a
/// millisecond.
pub const STIFFNESS_SECONDS: f64 = 0.004;

/// The speed at which hooks pull docks together, in mm/s: their reach in half the time of a latch. Assumed.
pub const PULL_SPEED: f64 = 30.0;

/// The speed at which hooks turn docks until they fit, in degrees/s. Assumed.
pub const PULL_TURN: f64 = 30.0;

/// The bandwidth of the accelerometer, in Hz: its filter before the converter. Assumed.
pub const ACCELEROMETER_HZ: f64 = 50.0;

/// The torque of dry friction between a gear and its joint while the teeth are between both sides of their
/// backlash, in Nm: a fiftieth of the gear's. Assumed.
pub const BACKLASH_FRICTION: f64 = 0.01;

/// The acceleration of gravity, in m/s².
pub const GRAVITY: f64 = 9.81;

/// The properties in which modules may differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Make {
    /// Its mass, in kg, including its load, spread evenly over its boxes.
    pub mass: f64,
    /// Its friction on the ground, as a multiple of the ground's coefficient.
    pub grip: f64,
    /// The motor of each of its joints.
    pub motor: Motor,
    /// The backlash of the gear of each of its joints, in degrees.
    pub backlash: f64,
    /// The angles by which the potentiometers of its joints are turned on their shafts, in degrees. The world
    /// does not use them.
    pub zeros: [f64; 3],
    /// By how much readings of its converters may be off, up or down, as a share of full scale, and the seed
    /// that decides on each of them. The world does not use them.
    pub noise: f64,
    pub noise_seed: u64,
    /// The probability with which the hooks of a latch miss a dock that they reach, and the seed that decides
    /// on each time. The world does not use them.
    pub misses: f64,
    pub hooks_seed: u64,
}

impl Default for Make {
    fn default() -> Self {
        let motor = Motor::default();
        Make {
            mass: MODULE_MASS,
            grip: 1.0,
            motor,
            backlash: 0.0,
            zeros: [0.0; 3],
            noise: 0.0,
            noise_seed: 0,
            misses: 0.0,
            hooks_seed: 0,
        }
    }
}
