//! How a robot lies when it gets its power: each body straight on its belly, rings curled up, all of them
//! side by side.

use glam::{DAffine3, DVec3};
use tasks::dock::Dock;

use crate::pose::Angles;
use crate::wiring::{Face, Wiring};

/// The way from one body to the next, in mm.
const APART: f64 = 2000.0;

/// The frame of a module, in mm, and the angles of its joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placing {
    pub frame: DAffine3,
    pub angles: Angles,
}

impl Wiring {
    /// Where all modules lie at power-up. The first of each body looks along x, with its Up above.
    pub fn placings(&self) -> Vec<Placing> {
        self.placings_bent(DAffine3::IDENTITY, |module| self.angles_at_rest(module))
    }

    /// Likewise where nothing bears them: each body is turned by `turn` where it lies, and each module has
    /// these angles.
    pub fn placings_bent(&self, turn: DAffine3, angles: impl Fn(usize) -> Angles) -> Vec<Placing> {
        let angles: Vec<Angles> = (0..self.modules()).map(angles).collect();
        let mut placings: Vec<Placing> =
            angles.iter().map(|&angles| Placing { frame: DAffine3::IDENTITY, angles }).collect();
        let mut is_found = vec![false; self.modules()];
        let mut bodies = 0;
        for first in 0..self.modules() {
            if is_found[first] {
                continue;
            }
            let place = DAffine3::from_translation(DVec3::NEG_Y * APART * f64::from(bodies));
            bodies += 1;
            for (module, pose) in self.poses(first, &|module| angles[module], &mut is_found) {
                placings[module].frame = place * (turn * pose);
            }
        }
        placings
    }

    /// Straight; in a ring of modules, Back to Front, bent so that the ring closes, with the Up of all
    /// inside.
    fn angles_at_rest(&self, module: usize) -> Angles {
        let mut round = 0;
        let mut next = module;
        while round < self.modules() {
            match self.attached(Face { module: next, dock: Dock::Back }) {
                Some(Face { module: behind, dock: Dock::Front }) => next = behind,
                _ => return [0.0; 3],
            }
            round += 1;
            if next == module {
                // Each module bends twice.
                let bend = 180.0 / round as f64;
                return [bend, 0.0, bend];
            }
        }
        [0.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;
    use plants::geometry;

    #[test]
    fn what_is_attached_fits_in_every_shape() {
        for shape in Shape::ALL {
            let wiring = shape.wiring(shape.usual_modules()).unwrap();
            let placings = wiring.placings();
            let dock = |face: Face| {
                let dock = geometry::Dock::ALL[usize::from(face.dock.index())];
                let Placing { frame, angles } = placings[face.module];
                (dock, frame * dock.in_module(angles))
            };
            for (one, other) in wiring.attachments() {
                let (mm, degrees) = geometry::before(dock(one), dock(other)).unwrap();
                assert!(
                    mm < 1e-6 && degrees < 1e-3,
                    "{shape:?}: {one} to {other}: {mm} mm, {degrees} degrees"
                );
            }
        }
    }

    #[test]
    fn what_is_not_attached_lies_apart() {
        let placings = Wiring::new(3).placings();
        for (one, other) in [(0, 1), (0, 2), (1, 2)] {
            let way = placings[one].frame.translation - placings[other].frame.translation;
            assert!(way.length() >= APART);
        }
    }
}
