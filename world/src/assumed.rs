//! What is assumed of the bodies and of the ground, for nothing of it is public. What is assumed of motors
//! and gears stands in [`plants::motor`].

use plants::motor::Motor;

/// The mass of a module, in kg. The parts of the laboratory's simulator (ReMod3D) add up to 1.109 kg.
/// Assumed: 0.5 kg a half, spread evenly over its box.
pub const MODULE_MASS: f64 = 1.0;

/// The friction between a module and the ground: aluminium and plastic on a floor. Assumed.
pub const FRICTION: f64 = 0.7;

/// How far the shell stays behind the face of a dock, in mm, so that modules side by side do not rub.
/// Assumed.
pub const SHELL: f64 = 1.0;

/// How much the part at the roll stays behind the shell of the halves, in mm. Assumed.
pub const SLIMMER: f64 = 1.0;

/// How soon what presses on the ground, or pulls at a dock, is brought back, in s: stiff, and no stiffer than
/// steps of a millisecond bear.
pub const STIFFNESS_SECONDS: f64 = 0.004;

/// How fast hooks pull docks together, in mm/s: their reach in half the time of a latch. Assumed.
pub const PULL_SPEED: f64 = 30.0;

/// How fast they turn them to fit, in degrees/s. Assumed likewise.
pub const PULL_TURN: f64 = 30.0;

/// The bandwidth of the accelerometer, in Hz: its filter before the converter. Assumed.
pub const ACCELEROMETER_HZ: f64 = 50.0;

/// The acceleration of gravity, in m/s².
pub const GRAVITY: f64 = 9.81;

/// What a module is made of, where it may differ from module to module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Make {
    /// Its mass, in kg, with all that it bears, spread evenly over its boxes.
    pub mass: f64,
    /// Its friction on the ground, as a multiple of the ground's coefficient.
    pub grip: f64,
    /// Of each of its joints.
    pub motor: Motor,
    /// How far the potentiometers of its joints sit turned on their shafts, in degrees. The world does not
    /// look at it.
    pub zeros: [f64; 3],
}

impl Default for Make {
    fn default() -> Self {
        Make { mass: MODULE_MASS, grip: 1.0, motor: Motor::default(), zeros: [0.0; 3] }
    }
}
