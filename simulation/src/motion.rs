//! How far a robot has come in a world.

/// How a robot has moved since power-up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// How far its middle has come ahead, in m: to where module 0 looked at power-up.
    pub distance: f64,
    /// How far it has come to the left, in m.
    pub sideways: f64,
    /// How long the robot was at power-up, to where module 0 looked, in m.
    pub length: f64,
    /// The mean speed at which what bears the robot slides on the ground, weighted by what it bears, over the
    /// robot's mean speed.
    pub slip: f64,
}
