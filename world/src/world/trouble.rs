//! Tells where and how a world broke.

use plants::trouble::Trouble;

use super::World;
use crate::face::Face;
use crate::history::Joint;
use crate::layout::{HINGE_POSITION, HINGE_SPEED};
use crate::model;
use crate::mujoco::Warning;

/// A joint that turns at this speed or faster shows that the simulation has exploded, in rad/s: 20 times the
/// speed of its motor without load.
const WILD: f64 = 28.0;

/// Docks that hold each other and are farther apart than this, in mm, have not come together. Docks that have
/// are off by tenths of a millimetre.
const APART: f64 = 20.0;

impl World {
    /// Keeps the result of a step in the history.
    pub(super) fn keep(&mut self, volts: &[[f64; 3]]) {
        let [positions, speeds] = [self.simulation.positions(), self.simulation.speeds()];
        let joints = volts.iter().enumerate().map(|(module, volts)| {
            let [angles, speeds] =
                [self.layout.angles(positions, module), self.layout.motors(speeds, module)];
            [0, 1, 2].map(|joint| Joint { angle: angles[joint], speed: speeds[joint], volts: volts[joint] })
        });
        self.history.keep(joints);
    }

    /// The trouble of a step with a warning. The solver computes all at once, so all numbers may be invalid,
    /// and the warning's index is only the first. The joint that turned fastest is named instead, if it is
    /// known.
    pub(super) fn broken(&self, warning: Warning) -> Trouble {
        match self.history.wildest() {
            Some((module, hinge)) => self.trouble(module, Some(hinge), warning.what.into()),
            None => self.named(warning),
        }
    }

    /// The trouble of the number with the warning's index.
    pub(super) fn named(&self, Warning { what, index }: Warning) -> Trouble {
        let (numbers, first) = if what.contains("position") {
            (self.layout.positions(), HINGE_POSITION)
        } else {
            (self.layout.speeds(), HINGE_SPEED)
        };
        let [module, place] = [index / numbers, index % numbers];
        if module >= self.modules() {
            return Trouble {
                seconds: self.seconds(),
                place: "the model".into(),
                what: what.into(),
                last: vec![],
            };
        }
        let joint = place.checked_sub(first).map(|hinge| self.layout.joint(hinge));
        self.trouble(module, joint, what.into())
    }

    fn trouble(&self, module: usize, hinge: Option<usize>, mut what: String) -> Trouble {
        if let Some(([one, other], mm)) = self.farthest().filter(|(_, mm)| *mm > APART) {
            what += &format!(
                "; {one} and {other} hold each other and are {mm:.0} mm apart: check that they can meet"
            );
        }
        let body = model::root(module) + hinge.map_or(0, |hinge| hinge + 1);
        let last = self.history.of(module, hinge.unwrap_or_else(|| self.history.fastest(module)));
        Trouble { seconds: self.seconds(), place: model::name(body), what, last }
    }

    /// Checks that no joint turns at an impossible speed.
    pub(super) fn expect_calm(&self) -> Result<(), Trouble> {
        let speeds = self.simulation.speeds();
        if let Some(index) = speeds.iter().position(|speed| !speed.is_finite()) {
            return Err(self.broken(Warning { what: "a speed that is not a number", index }));
        }
        match self.history.wildest() {
            Some((module, hinge)) if self.speeds(module)[hinge].abs() >= WILD => {
                let speed = self.speeds(module)[hinge].to_degrees();
                Err(self.trouble(module, Some(hinge), format!("its joint turns at {speed:.0} degrees/s")))
            }
            _ => Ok(()),
        }
    }

    /// The pair of docks that hold each other and are the farthest apart, and their distance, in mm.
    fn farthest(&self) -> Option<([Face; 2], f64)> {
        let apart = self.welds.iter().flatten().map(|weld| (weld.faces, weld.error(&self.simulation).0));
        apart.max_by(|one, other| one.1.total_cmp(&other.1))
    }
}
