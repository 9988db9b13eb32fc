//! How far a robot has come.

/// How a robot has moved since the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// How far its middle has come ahead, in m: to where module 0 looked at the beginning.
    pub distance: f64,
    /// How far it has come to the left, in m.
    pub sideways: f64,
    /// How long the robot was at the beginning, to where module 0 looked, in m.
    pub length: f64,
    /// The mean speed at which what bears the robot slides on the ground, weighted by what it bears, over the
    /// robot's mean speed. Infinite for a robot that has not come anywhere.
    pub slip: f64,
}
