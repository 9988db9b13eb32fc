//! The world: modules, the welds that hold them together, and the ground.

mod laying;
mod readings;
mod trouble;

use glam::DVec3;
use plants::geometry::Half;
use plants::motor::Motor;
use plants::trouble::Trouble;
use thiserror::Error;

use crate::face::Face;
use crate::ground::Ground;
use crate::history::History;
use crate::layout::Layout;
use crate::libm;
use crate::model::{self, MILLI, Placed};
use crate::motion::{LOOK, Odometer};
use crate::mujoco::{Contact, Simulation, Warning};
use crate::weld::{self, Weld};

/// A joint that is jammed withstands so much torque, in Nm, many times that of its motor.
const JAM: f64 = 100.0;

/// Why a world can't be made.
#[derive(Debug, Error)]
pub enum WorldError {
    #[error("a world needs at least one module")]
    Empty,
    #[error(
        "module {module} lies where a step, a box or a wall is, {millimetres:.0} mm deep in it: move that \
         obstacle"
    )]
    Occupied { module: usize, millimetres: f64 },
    #[error("MuJoCo rejects the model: {0}; please report the robot that leads to it")]
    Model(String),
}

/// Modules in a physical world.
pub struct World {
    simulation: Simulation,
    layout: Layout,
    /// By module, the motor of each of its joints.
    motors: Vec<Motor>,
    /// Geoms of the ground, before those of the modules.
    ground_geoms: usize,
    /// By the index of the constraint.
    welds: Vec<Option<Weld>>,
    steps: u64,
    /// By module, the force that pushes it, in N, and the number of steps that are left.
    pushes: Vec<([f64; 3], u32)>,
    /// By module, whether each of its joints is jammed.
    jammed: Vec<[bool; 3]>,
    odometer: Odometer,
    history: History,
}

impl World {
    /// A world with these modules on `ground`, at rest, attached to nothing. The lowest module touches the
    /// ground.
    ///
    /// # Errors
    /// There is no module; a module lies inside an obstacle; or MuJoCo does not accept the model.
    pub fn new(modules: &[Placed], ground: &Ground) -> Result<Self, WorldError> {
        if modules.is_empty() {
            return Err(WorldError::Empty);
        }
        // The use of the addresses keeps the linker from dropping the functions of `libm`.
        assert!(std::hint::black_box(libm::bound()).all(|function| function != 0));
        let text = model::text(modules, ground).map_err(|error| WorldError::Model(error.to_string()))?;
        let mut simulation = Simulation::new(&text).map_err(WorldError::Model)?;
        let layout = model::layout(modules);
        for (module, Placed { angles, .. }) in modules.iter().enumerate() {
            for (joint, degrees) in angles.iter().enumerate() {
                simulation.positions_mut()[layout.position(module, joint)] = degrees.to_radians();
            }
        }
        let welds = (0..model::welds(modules.len())).map(|_| None).collect();
        let mut world = World {
            simulation,
            layout,
            motors: modules.iter().map(|module| module.make.motor).collect(),
            ground_geoms: ground.geoms(),
            welds,
            steps: 0,
            pushes: vec![([0.0; 3], 0); modules.len()],
            jammed: vec![[false; 3]; modules.len()],
            odometer: Odometer::default(),
            history: History::new(),
        };
        let all: Vec<usize> = (0..modules.len()).collect();
        world.put_on_ground(std::slice::from_ref(&all));
        if let Some((module, depth)) = world.deepest(&all) {
            return Err(WorldError::Occupied { module, millimetres: depth / MILLI });
        }
        world.odometer = Odometer::new(world.middle(), world.length(), world.axes());
        Ok(world)
    }

    /// Advances the world by a millisecond, with `volts` at the motors of each module.
    ///
    /// # Errors
    /// The world can't continue, because its state is not physical any more.
    pub fn step(&mut self, volts: &[[f64; 3]]) -> Result<(), Trouble> {
        for (module, (volts, motor)) in volts.iter().zip(&self.motors).enumerate() {
            for (joint, volts) in volts.iter().enumerate() {
                let place = self.layout.speed(module, joint);
                let speed = self.simulation.speeds()[place];
                // The torque at standstill: the model's damping has the part that depends on speed.
                self.simulation.forces_mut()[place] = motor.torque(motor.amperes(*volts, 0.0));
                let is_jammed = self.jammed[module][joint];
                self.simulation.friction_mut()[place] = if is_jammed { JAM } else { motor.friction(speed) };
            }
        }
        for (module, (newtons, steps)) in self.pushes.iter_mut().enumerate() {
            if *steps == 0 {
                *newtons = [0.0; 3];
            }
            *steps = steps.saturating_sub(1);
            self.simulation.forces_mut()[self.layout.speeds() * module..][..3].copy_from_slice(newtons);
        }
        for (index, weld) in self.welds.iter_mut().enumerate() {
            if let Some(weld) = weld.as_mut().filter(|weld| weld.pulls()) {
                weld.pull(&mut self.simulation, index);
            }
        }
        self.steps += 1;
        if let Some(index) = self.simulation.forces_mut().iter().position(|force| !force.is_finite()) {
            self.keep(volts);
            return Err(self.named(Warning { what: "a force that is not a number", index }));
        }
        let stepped = self.simulation.step();
        self.keep(volts);
        stepped.map_err(|warning| self.broken(warning))?;
        self.expect_calm()?;
        if self.steps.is_multiple_of(LOOK) {
            let slides: Vec<_> = self.slides().collect();
            self.odometer.look(&self.axes(), &slides);
        }
        Ok(())
    }

    /// Lets two docks take hold of each other where they are, and pull until they fit. They release the docks
    /// that they held before.
    pub fn attach(&mut self, one: Face, other: Face) {
        self.detach(one);
        self.detach(other);
        let weld = Weld::new(&self.simulation, [one, other]);
        let Some(index) = self.welds.iter().position(Option::is_none) else { return };
        self.welds[index].insert(weld).pull(&mut self.simulation, index);
    }

    /// Releases a dock from the one that it holds.
    pub fn detach(&mut self, face: Face) {
        let holds = |weld: &Option<Weld>| weld.as_ref().is_some_and(|weld| weld.faces.contains(&face));
        if let Some(index) = self.welds.iter().position(holds) {
            self.welds[index] = None;
            self.simulation.release(index);
        }
    }

    /// Pushes a module from now on for `milliseconds`, with a force of `newtons` along x, y and z. This
    /// replaces an earlier push.
    pub fn push(&mut self, module: usize, newtons: [f64; 3], milliseconds: u32) {
        self.pushes[module] = (newtons, milliseconds);
    }

    /// Holds a joint fast, or lets it go.
    pub fn jam(&mut self, module: usize, joint: usize, is_jammed: bool) {
        self.jammed[module][joint] = is_jammed;
    }

    /// Swaps two modules. Each gets the joint angles of the other, because it must be bent so to fit there.
    /// The docks that held one module then hold the other.
    pub fn swap(&mut self, one: usize, other: usize) {
        swap(self.simulation.positions_mut(), self.layout.positions(), one, other);
        swap(self.simulation.speeds_mut(), self.layout.speeds(), one, other);
        for (index, weld) in self.welds.iter_mut().enumerate() {
            if let Some(weld) = weld {
                weld.swap(one, other, &mut self.simulation, index);
            }
        }
        self.simulation.update();
    }

    /// The body of a module that touches the ground in a contact.
    fn body_of(&self, contact: &Contact) -> usize {
        contact.geoms[0].max(contact.geoms[1]) + 1 - self.ground_geoms
    }

    fn module_of(&self, contact: &Contact) -> usize {
        model::module(self.body_of(contact))
    }

    /// The corners of a module's halves, in m.
    fn corners_of(&self, module: usize) -> impl Iterator<Item = DVec3> {
        let corners = model::corners();
        [Half::Front, Half::Back].into_iter().flat_map(move |half| {
            let frame = weld::frame(&self.simulation, model::half(module, half));
            corners[half as usize].map(|corner| frame.transform_point3(corner))
        })
    }

    /// The middle of these modules, in m.
    fn middle_of(&self, modules: &[usize]) -> DVec3 {
        modules.iter().map(|&module| self.place(module)).sum::<DVec3>() / modules.len() as f64
    }

    /// The axes of all bodies, seen from above.
    fn axes(&self) -> Vec<[f64; 2]> {
        let turns =
            (0..model::BODIES * self.modules()).map(|body| self.simulation.pose(model::root(0) + body).1);
        turns
            .flat_map(|turn| [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turn * axis))
            .map(|axis| [axis.x, axis.y])
            .collect()
    }

    /// For each contact with the ground, the normal force, in N, and the speed at which the module slides
    /// there, in m/s.
    fn slides(&self) -> impl Iterator<Item = (f64, f64)> {
        self.simulation.contacts().map(|contact| {
            let velocity = self.simulation.velocity(self.body_of(&contact), contact.position);
            let along = velocity - contact.normal * velocity.dot(contact.normal);
            (contact.force, along.length())
        })
    }
}

/// Swaps two blocks of `length` numbers.
fn swap(numbers: &mut [f64], length: usize, one: usize, other: usize) {
    for index in 0..length {
        numbers.swap(length * one + index, length * other + index);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assumed::{Make, SHELL};
    use glam::DAffine3;
    use plants::geometry::EDGE;

    #[test]
    fn what_moves_along_the_ground_slides() {
        let [end, side] = [EDGE - SHELL, EDGE / 2.0 - SHELL].map(|mm| mm * MILLI);
        let [joint, half] = [end - side, side];
        let corner = |along: f64, across: f64| along.hypot(across);
        // How it is rolled, in degrees; the speed of its middle along x, y and z, that at which it turns
        // about z, and that of the joint in front; how fast how many of the corners of its halves slide.
        for (roll, speeds, slides) in [
            (0.0, [0.3, 0.0, -0.5, 0.0, 0.0], &[(0.3, 8)][..]),
            (0.0, [0.0, -0.4, 0.0, 0.0, 0.0], &[(0.4, 8)]),
            (0.0, [0.0, 0.0, -0.2, 0.0, 0.0], &[(0.0, 8)]),
            (
                0.0,
                [0.0, 0.0, -0.2, 3.0, 0.0],
                &[(3.0 * corner(end, side), 4), (3.0 * corner(joint, side), 4)],
            ),
            (
                0.0,
                [0.3, 0.0, 0.0, 3.0, 0.0],
                &[
                    (corner(0.3 + 3.0 * side, 3.0 * end), 2),
                    (corner(0.3 - 3.0 * side, 3.0 * end), 2),
                    (corner(0.3 + 3.0 * side, 3.0 * joint), 2),
                    (corner(0.3 - 3.0 * side, 3.0 * joint), 2),
                ],
            ),
            (
                0.0,
                [0.3, 0.2, 0.0, 3.0, 0.0],
                &[
                    (corner(0.3 - 3.0 * side, 0.2 + 3.0 * end), 1),
                    (corner(0.3 + 3.0 * side, 0.2 - 3.0 * end), 1),
                ],
            ),
            // The joint turns the half in front down, or along the ground.
            (0.0, [0.0, 0.0, -0.2, 0.0, 2.0], &[(2.0 * side, 4), (0.0, 4)]),
            (90.0, [0.0, 0.0, 0.0, 0.0, 2.0], &[(2.0 * corner(half, side), 2), (2.0 * side, 2), (0.0, 4)]),
        ] {
            let at = |y| Placed {
                frame: DAffine3::from_translation(DVec3::Y * y)
                    * DAffine3::from_rotation_x(f64::to_radians(roll)),
                angles: [0.0; 3],
                make: Make::default(),
            };
            let mut world = World::new(&[at(0.0), at(1000.0)], &Ground::default()).unwrap();
            let [x, y, z, yaw, turn] = speeds;
            for module in [0, 1] {
                // It has to touch the ground.
                world.simulation.positions_mut()[world.layout.positions() * module + 2] -= 1e-5;
                let all = [x, y, z, 0.0, 0.0, yaw, turn, 0.0, 0.0];
                world.simulation.speeds_mut()[all.len() * module..][..all.len()].copy_from_slice(&all);
            }
            world.simulation.update();
            let found: Vec<_> = world.slides().collect();
            for &(speed, corners) in slides {
                let near = found.iter().filter(|(_, it)| (it - speed).abs() < 1e-4).count();
                assert_eq!(near, 2 * corners, "{roll} {speeds:?}, {speed} m/s: {found:?}");
            }
            assert!(found.iter().map(|(force, _)| force).sum::<f64>() > 1.0, "{speeds:?}: {found:?}");
        }
    }
}
