//! Lays bodies of modules on the ground.

use glam::DAffine3;

use super::World;
use crate::layout::HINGE_POSITION;
use crate::model;
use crate::weld;

/// A module that is no deeper in an obstacle than this, in m, only touches it.
const TOUCH: f64 = 1e-3;

/// The most times that a robot is raised until it is not inside an obstacle any more.
const RAISES: usize = 100;

impl World {
    /// Turns each body of modules by `degrees` about its initial long axis, its left side up, and lays it
    /// down where it is.
    pub fn turn_over(&mut self, degrees: f64) {
        let bodies = self.bodies();
        bodies.iter().for_each(|body| self.turn(body, degrees));
        self.simulation.speeds_mut().fill(0.0);
        self.put_on_ground(&bodies);
        // An obstacle on the ground may be in the way.
        for _ in 0..RAISES {
            let deep: Vec<_> = bodies.iter().filter_map(|body| Some((body, self.deepest(body)?.1))).collect();
            if deep.is_empty() {
                break;
            }
            deep.iter().for_each(|(body, depth)| self.raise(body, *depth));
            self.simulation.update();
        }
    }

    fn turn(&mut self, body: &[usize], degrees: f64) {
        let middle = self.middle_of(body);
        let turn = DAffine3::from_translation(middle)
            * DAffine3::from_rotation_x(degrees.to_radians())
            * DAffine3::from_translation(-middle);
        for &module in body {
            let frame = turn * weld::frame(&self.simulation, model::root(module));
            let (_, rotation, position) = frame.to_scale_rotation_translation();
            let first = self.layout.positions() * module;
            let place = &mut self.simulation.positions_mut()[first..][..HINGE_POSITION];
            place[..3].copy_from_slice(&position.to_array());
            place[3..].copy_from_slice(&[rotation.w, rotation.x, rotation.y, rotation.z]);
        }
    }

    /// The bodies: groups of modules that hold each other, directly or through others.
    fn bodies(&self) -> Vec<Vec<usize>> {
        let mut body_of: Vec<usize> = (0..self.modules()).collect();
        for weld in self.welds.iter().flatten() {
            let [one, other] = weld.faces.map(|face| body_of[face.module]);
            body_of.iter_mut().filter(|body| **body == other).for_each(|body| *body = one);
        }
        let mut bodies = vec![Vec::new(); self.modules()];
        (0..self.modules()).for_each(|module| bodies[body_of[module]].push(module));
        bodies.retain(|body| !body.is_empty());
        bodies
    }

    /// The one of these modules that is deepest inside an obstacle, and its depth, in m; `None` if none is
    /// deeper than [`TOUCH`].
    pub(super) fn deepest(&self, modules: &[usize]) -> Option<(usize, f64)> {
        let standing = 1..self.ground_geoms;
        let contacts = self.simulation.contacts().filter(|contact| standing.contains(&contact.geoms[0]));
        let depths = contacts.map(|contact| (self.module_of(&contact), contact.depth));
        let deep = depths.filter(|(module, depth)| *depth > TOUCH && modules.contains(module));
        deep.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Raises or lowers each of these bodies until its lowest corner touches the plane.
    pub(super) fn put_on_ground(&mut self, bodies: &[Vec<usize>]) {
        self.simulation.update();
        for body in bodies {
            let corners = body.iter().flat_map(|&module| self.corners_of(module));
            let lowest = corners.map(|corner| corner.z).fold(f64::INFINITY, f64::min);
            self.raise(body, -lowest);
        }
        self.simulation.update();
    }

    /// Raises these modules by `height`, in m. An update of the simulation has to follow.
    fn raise(&mut self, modules: &[usize], height: f64) {
        for module in modules {
            self.simulation.positions_mut()[self.layout.positions() * module + 2] += height;
        }
    }
}
