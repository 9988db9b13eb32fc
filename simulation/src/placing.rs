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
        let mut next = module;
        for round in 1_u32.. {
            match self.attached(Face { module: next, dock: Dock::Back }) {
                Some(Face { module: behind, dock: Dock::Front }) => next = behind,
                _ => break,
            }
            if next == module {
                // Each module bends twice.
                let bend = 180.0 / f64::from(round);
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
    fn bodies_lie_side_by_side_each_to_the_right_of_the_one_before() {
        // A ring of three, two modules of which the second is ahead, and one alone.
        let mut wiring = Wiring::new(6);
        for (back, front) in [(0, 1), (1, 2), (2, 0), (4, 3)] {
            let [back, front] =
                [(back, Dock::Back), (front, Dock::Front)].map(|(module, dock)| Face { module, dock });
            wiring.attach(back, front).unwrap();
        }
        let bent = [60.0, 0.0, 60.0];
        let turn = DAffine3::from_rotation_x(1.0);
        let turned = wiring.placings_bent(turn, |module| if module < 3 { bent } else { [0.0; 3] });
        for (body, first, last, angles) in [(0.0, 0, 2, bent), (1.0, 3, 4, [0.0; 3]), (2.0, 5, 5, [0.0; 3])] {
            let place = DAffine3::from_translation(DVec3::NEG_Y * APART * body);
            let placings = wiring.placings();
            assert_eq!(placings[first], Placing { frame: place, angles }, "{first}");
            for module in first..=last {
                let expected = place * turn * place.inverse() * placings[module].frame;
                assert!(turned[module].frame.abs_diff_eq(expected, 1e-9), "{module}: {turned:?}");
            }
        }
        let [behind, ahead] = [3, 4].map(|module| wiring.placings()[module].frame.translation);
        assert!(ahead.abs_diff_eq(behind + DVec3::X * 2.0 * geometry::EDGE, 1e-9), "{ahead}");
    }
}
