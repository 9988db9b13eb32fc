//! Where the numbers of modules are in MuJoCo's state.

/// The index of the first hinge among the positions of a module, behind three numbers and a quaternion of its
/// root; and among its speeds, behind six of its root.
pub const HINGE_POSITION: usize = 7;
pub const HINGE_SPEED: usize = 6;

/// Where the numbers of a module are among all positions and speeds. All modules of a world have as many.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Of each joint: one that its motor turns, and behind it, if gears have backlash, one for that.
    hinges: usize,
}

impl Layout {
    pub fn new(has_backlash: bool) -> Self {
        Layout { hinges: if has_backlash { 2 } else { 1 } }
    }

    /// Whether each joint has a hinge for the backlash of its gear.
    pub fn has_backlash(self) -> bool {
        self.hinges == 2
    }

    /// Positions of a module.
    pub fn positions(self) -> usize {
        HINGE_POSITION + 3 * self.hinges
    }

    /// Speeds of a module.
    pub fn speeds(self) -> usize {
        HINGE_SPEED + 3 * self.hinges
    }

    /// The index of what a joint's motor has turned it by.
    pub fn position(self, module: usize, joint: usize) -> usize {
        self.positions() * module + HINGE_POSITION + self.hinges * joint
    }

    /// The index of the speed of a joint's motor.
    pub fn speed(self, module: usize, joint: usize) -> usize {
        self.speeds() * module + HINGE_SPEED + self.hinges * joint
    }

    /// The angles of a module's joints among all `positions`.
    pub fn angles(self, positions: &[f64], module: usize) -> [f64; 3] {
        [0, 1, 2].map(|joint| positions[self.position(module, joint)..][..self.hinges].iter().sum())
    }

    /// The speeds of the motors of a module's joints among all `speeds`.
    pub fn motors(self, speeds: &[f64], module: usize) -> [f64; 3] {
        [0, 1, 2].map(|joint| speeds[self.speed(module, joint)])
    }

    /// The joint of a hinge, which is counted from the first of its module.
    pub fn joint(self, hinge: usize) -> usize {
        hinge / self.hinges
    }
}
