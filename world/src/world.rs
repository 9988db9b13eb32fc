//! The world: modules, what holds them together, and the ground.

use glam::{DAffine3, DVec3};
use plants::geometry::{Angles, Dock, Half};
use plants::motion::Motion;
use plants::motor;
use thiserror::Error;

use crate::assumed::GRAVITY;
use crate::ground::Ground;
use crate::libm;
use crate::model::{self, HINGE_POSITION, HINGE_SPEED, MILLI, POSITIONS, SPEEDS};
use crate::motion::Odometer;
use crate::mujoco::{Simulation, Warning};
use crate::weld::{self, Weld};

/// A step, in s.
pub const STEP_SECONDS: f64 = 1e-3;

/// A joint that turns faster than this has exploded, in rad/s: 20 times what its motor turns without load.
const WILD: f64 = 28.0;

/// A dock of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    pub module: usize,
    pub dock: Dock,
}

/// A module at the beginning: its frame, in mm, and the angles of its joints.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    pub frame: DAffine3,
    pub angles: Angles,
}

/// Why there is no such world.
#[derive(Debug, Error)]
pub enum WorldError {
    #[error("a world needs a module at least")]
    Empty,
    #[error("MuJoCo does not take the model: {0}; tell us how you came by it")]
    Model(String),
}

/// Why a world can't go on.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Trouble {
    #[error("the world broke after {seconds:.3} s at {place}: {what}")]
    Warning { seconds: f64, place: String, what: &'static str },
    #[error(
        "the world broke after {seconds:.3} s at {place}: its joint turns at {degrees_per_second:.0} \
         degrees/s"
    )]
    Wild { seconds: f64, place: String, degrees_per_second: f64 },
}

/// Modules in a physical world.
pub struct World {
    simulation: Simulation,
    modules: usize,
    /// Geoms of the ground, before those of the modules.
    ground_geoms: usize,
    /// By constraint.
    welds: Vec<Option<Weld>>,
    steps: u64,
    odometer: Odometer,
}

impl World {
    /// A world with these modules on `ground`, at rest, attached to nothing. The lowest of them touches the
    /// ground.
    ///
    /// # Errors
    /// There is no module; or MuJoCo does not take what was made of them.
    pub fn new(modules: &[Placed], ground: &Ground) -> Result<Self, WorldError> {
        if modules.is_empty() {
            return Err(WorldError::Empty);
        }
        // Whatever the linker thinks of them, they have to be there.
        assert!(std::hint::black_box(libm::bound()).all(|function| function != 0));
        let text = model::text(modules, ground).map_err(|error| WorldError::Model(error.to_string()))?;
        let mut simulation = Simulation::new(&text).map_err(WorldError::Model)?;
        for (module, Placed { angles, .. }) in modules.iter().enumerate() {
            let hinges = &mut simulation.positions_mut()[POSITIONS * module + HINGE_POSITION..][..3];
            hinges.copy_from_slice(&angles.map(f64::to_radians));
        }
        let welds = (0..model::welds(modules.len())).map(|_| None).collect();
        let mut world = World {
            simulation,
            modules: modules.len(),
            ground_geoms: ground.geoms(),
            welds,
            steps: 0,
            odometer: Odometer::default(),
        };
        world.put_on_ground();
        world.odometer = Odometer::new(&world);
        Ok(world)
    }

    /// Lets a millisecond pass, with so many volts at the motors of each module.
    ///
    /// # Errors
    /// The world can't go on: what has come of it is no physics.
    pub fn step(&mut self, volts: &[[f64; 3]]) -> Result<(), Trouble> {
        for (module, volts) in volts.iter().enumerate().take(self.modules) {
            for (hinge, volts) in volts.iter().enumerate() {
                let place = SPEEDS * module + HINGE_SPEED + hinge;
                let speed = self.simulation.speeds()[place];
                // What the joint's speed takes from it is the model's damping.
                self.simulation.forces_mut()[place] = motor::torque(motor::amperes(*volts, 0.0));
                self.simulation.friction_mut()[place] = motor::friction(speed);
            }
        }
        for (index, weld) in self.welds.iter_mut().enumerate() {
            if let Some(weld) = weld.as_mut().filter(|weld| weld.pulls()) {
                weld.pull(&mut self.simulation, index);
            }
        }
        self.steps += 1;
        let stepped = self.simulation.step();
        stepped.map_err(|warning| self.broken(warning))?;
        self.expect_calm()?;
        self.odometer = std::mem::take(&mut self.odometer).look(self);
        Ok(())
    }

    fn broken(&self, Warning { what, index }: Warning) -> Trouble {
        let module = if what.contains("position") { index / POSITIONS } else { index / SPEEDS };
        let place = if module < self.modules { model::name(model::root(module)) } else { "the model".into() };
        Trouble::Warning { seconds: self.seconds(), place, what }
    }

    /// No joint turns as none can.
    fn expect_calm(&self) -> Result<(), Trouble> {
        for (index, speed) in self.simulation.speeds().iter().enumerate() {
            let [module, place] = [index / SPEEDS, index % SPEEDS];
            let is_calm = place < HINGE_SPEED || speed.abs() < WILD;
            if !is_calm || !speed.is_finite() {
                let body = model::root(module) + 1 + place.saturating_sub(HINGE_SPEED);
                let degrees_per_second = speed.to_degrees();
                return Err(Trouble::Wild {
                    seconds: self.seconds(),
                    place: model::name(body),
                    degrees_per_second,
                });
            }
        }
        Ok(())
    }

    /// Two docks take hold of each other where they are, and pull until they fit.
    pub fn attach(&mut self, one: Face, other: Face) {
        let weld = Weld::new(&self.simulation, [one, other]);
        let Some(index) = self.welds.iter().position(Option::is_none) else { return };
        self.welds[index].insert(weld).pull(&mut self.simulation, index);
    }

    /// A dock lets go of the other.
    pub fn detach(&mut self, face: Face) {
        let holds = |weld: &Option<Weld>| weld.as_ref().is_some_and(|weld| weld.faces.contains(&face));
        if let Some(index) = self.welds.iter().position(holds) {
            self.welds[index] = None;
            self.simulation.release(index);
        }
    }

    /// Two modules change places, with the angles of their joints. What holds them is not changed.
    pub fn swap(&mut self, one: usize, other: usize) {
        swap(self.simulation.positions_mut(), POSITIONS, one, other);
        swap(self.simulation.speeds_mut(), SPEEDS, one, other);
        self.simulation.update();
    }

    /// Turns the whole robot by so many degrees about the long axis that it began with, and lays it down.
    pub fn turn_over(&mut self, degrees: f64) {
        let middle = self.middle();
        let turn = DAffine3::from_translation(middle)
            * DAffine3::from_rotation_x(-degrees.to_radians())
            * DAffine3::from_translation(-middle);
        for module in 0..self.modules {
            let frame = turn * weld::frame(&self.simulation, model::root(module));
            let (_, rotation, position) = frame.to_scale_rotation_translation();
            let place = &mut self.simulation.positions_mut()[POSITIONS * module..][..HINGE_POSITION];
            place[..3].copy_from_slice(&position.to_array());
            place[3..].copy_from_slice(&[rotation.w, rotation.x, rotation.y, rotation.z]);
        }
        self.simulation.speeds_mut().fill(0.0);
        self.put_on_ground();
    }

    /// Raises or lowers all modules so that the lowest touches the ground.
    fn put_on_ground(&mut self) {
        self.simulation.update();
        let lowest = self.corners().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
        for module in 0..self.modules {
            self.simulation.positions_mut()[POSITIONS * module + 2] -= lowest;
        }
        self.simulation.update();
    }

    /// The corners of all halves, in m.
    fn corners(&self) -> impl Iterator<Item = DVec3> {
        let corners = model::corners();
        let halves = (0..self.modules).flat_map(|module| [(module, Half::Front), (module, Half::Back)]);
        halves.flat_map(move |(module, half)| {
            let frame = weld::frame(&self.simulation, model::half(module, half));
            corners[half as usize].map(|corner| frame.transform_point3(corner))
        })
    }

    /// How long the robot is along x, in m.
    pub fn length(&self) -> f64 {
        let (least, most) =
            self.corners().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), corner| {
                (least.min(corner.x), most.max(corner.x))
            });
        most - least
    }

    /// How many modules there are.
    pub fn modules(&self) -> usize {
        self.modules
    }

    /// Since the beginning.
    pub fn seconds(&self) -> f64 {
        self.steps as f64 * STEP_SECONDS
    }

    /// The angles of a module's joints, in rad.
    pub fn angles(&self, module: usize) -> [f64; 3] {
        let place = POSITIONS * module + HINGE_POSITION;
        [0, 1, 2].map(|hinge| self.simulation.positions()[place + hinge])
    }

    /// How fast a module's joints turn, in rad/s.
    pub fn speeds(&self, module: usize) -> [f64; 3] {
        let place = SPEEDS * module + HINGE_SPEED;
        [0, 1, 2].map(|hinge| self.simulation.speeds()[place + hinge])
    }

    /// What an accelerometer without a filter reads in the half with the Front dock, along x, y and z of
    /// that, in multiples of the acceleration of gravity.
    pub fn acceleration(&self, module: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.simulation.sensors()[3 * module + axis] / GRAVITY)
    }

    /// The frame of a dock, in mm.
    pub fn dock(&self, face: Face) -> DAffine3 {
        weld::dock(&self.simulation, face)
    }

    /// The frame of a module's front half, in mm.
    pub fn front(&self, module: usize) -> DAffine3 {
        let frame = weld::frame(&self.simulation, model::half(module, Half::Front));
        DAffine3 { translation: frame.translation / MILLI, ..frame }
    }

    /// The most by which docks that are attached are off: in mm, and in degrees.
    pub fn dock_error(&self) -> (f64, f64) {
        let errors = self.welds.iter().flatten().map(|weld| weld.error(&self.simulation));
        errors.fold((0.0, 0.0), |(far, turned), (mm, degrees)| (far.max(mm), turned.max(degrees)))
    }

    /// The middle of all modules, in m.
    pub fn middle(&self) -> DVec3 {
        let middles = (0..self.modules).map(|module| self.simulation.pose(model::root(module)).0);
        middles.sum::<DVec3>() / self.modules as f64
    }

    /// The axes of all bodies as seen from above.
    pub(crate) fn axes(&self) -> Vec<[f64; 2]> {
        let turns = (0..model::BODIES * self.modules).map(|body| self.simulation.pose(model::root(0) + body).1);
        turns
            .flat_map(|turn| [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turn * axis))
            .map(|axis| [axis.x, axis.y])
            .collect()
    }

    /// How the robot has moved so far.
    pub fn motion(&self) -> Motion {
        self.odometer.motion(self)
    }

    /// Of each contact with the ground the normal force, in N, and how fast the module slides there, in m/s.
    pub(crate) fn slides(&self) -> impl Iterator<Item = (f64, f64)> {
        self.simulation.contacts().map(|contact| {
            let geom = contact.geoms[0].max(contact.geoms[1]);
            let body = geom + 1 - self.ground_geoms;
            let velocity = self.simulation.velocity(body, contact.position);
            let along = velocity - contact.normal * velocity.dot(contact.normal);
            (contact.force, along.length())
        })
    }

    /// The numbers that make up its state.
    pub fn state(&self) -> impl Iterator<Item = f64> {
        self.simulation.positions().iter().chain(self.simulation.speeds()).copied()
    }
}

/// Exchanges two pieces of so many numbers.
fn swap(numbers: &mut [f64], length: usize, one: usize, other: usize) {
    for index in 0..length {
        numbers.swap(length * one + index, length * other + index);
    }
}
