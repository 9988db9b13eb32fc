//! The world: modules, the welds that hold them together, and the ground.

use std::fmt;

use glam::{DAffine3, DVec3};
use plants::geometry::{Angles, Dock, Half};
use plants::motion::Motion;
use plants::motor::Motor;
use plants::trouble::Trouble;
use thiserror::Error;

use crate::assumed::{GRAVITY, Make};
use crate::ground::Ground;
use crate::history::{History, Joint};
use crate::libm;
use crate::model::{self, HINGE_POSITION, HINGE_SPEED, MILLI, POSITIONS, SPEEDS};
use crate::motion::Odometer;
use crate::mujoco::{Contact, Simulation, Warning};
use crate::weld::{self, Weld};

/// A step, in s.
pub const STEP_SECONDS: f64 = 1e-3;

/// A joint that turns at this speed or faster shows that the simulation has exploded, in rad/s: 20 times the
/// speed of its motor without load.
const WILD: f64 = 28.0;

/// Docks that hold each other and are farther apart than this, in mm, have not come together. Docks that have
/// are off by tenths of a millimetre.
const APART: f64 = 20.0;

/// A module that is no deeper in an obstacle than this, in m, only touches it.
const TOUCH: f64 = 1e-3;

/// The most times that a robot is raised until it is not inside an obstacle any more.
const RAISES: usize = 100;

/// A dock of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    pub module: usize,
    pub dock: Dock,
}

impl fmt::Display for Face {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}.{:?}", self.module, self.dock)
    }
}

/// A module at the beginning: its frame, in mm, the angles of its joints, in degrees, and its make.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    pub frame: DAffine3,
    pub angles: Angles,
    pub make: Make,
}

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
    /// By module, the motor of each of its joints.
    motors: Vec<Motor>,
    /// Geoms of the ground, before those of the modules.
    ground_geoms: usize,
    /// By the index of the constraint.
    welds: Vec<Option<Weld>>,
    steps: u64,
    /// By module, the force that pushes it, in N, and the number of steps that are left.
    pushes: Vec<([f64; 3], u32)>,
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
        for (module, Placed { angles, .. }) in modules.iter().enumerate() {
            let hinges = &mut simulation.positions_mut()[POSITIONS * module + HINGE_POSITION..][..3];
            hinges.copy_from_slice(&angles.map(f64::to_radians));
        }
        let welds = (0..model::welds(modules.len())).map(|_| None).collect();
        let mut world = World {
            simulation,
            motors: modules.iter().map(|module| module.make.motor).collect(),
            ground_geoms: ground.geoms(),
            welds,
            steps: 0,
            pushes: vec![([0.0; 3], 0); modules.len()],
            odometer: Odometer::default(),
            history: History::new(),
        };
        let all: Vec<usize> = (0..modules.len()).collect();
        world.put_on_ground(std::slice::from_ref(&all));
        if let Some((module, depth)) = world.deepest(&all) {
            return Err(WorldError::Occupied { module, millimetres: depth / MILLI });
        }
        world.odometer = Odometer::new(&world);
        Ok(world)
    }

    /// Advances the world by a millisecond, with `volts` at the motors of each module.
    ///
    /// # Errors
    /// The world can't continue, because its state is not physical any more.
    pub fn step(&mut self, volts: &[[f64; 3]]) -> Result<(), Trouble> {
        for (module, (volts, motor)) in volts.iter().zip(&self.motors).enumerate() {
            for (hinge, volts) in volts.iter().enumerate() {
                let place = SPEEDS * module + HINGE_SPEED + hinge;
                let speed = self.simulation.speeds()[place];
                // The torque at standstill: the model's damping has the part that depends on speed.
                self.simulation.forces_mut()[place] = motor.torque(motor.amperes(*volts, 0.0));
                self.simulation.friction_mut()[place] = motor.friction(speed);
            }
        }
        for (module, (newtons, steps)) in self.pushes.iter_mut().enumerate() {
            if *steps == 0 {
                *newtons = [0.0; 3];
            }
            *steps = steps.saturating_sub(1);
            self.simulation.forces_mut()[SPEEDS * module..][..3].copy_from_slice(newtons);
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
        self.odometer = std::mem::take(&mut self.odometer).look(self);
        Ok(())
    }

    /// Keeps the result of a step in the history.
    fn keep(&mut self, volts: &[[f64; 3]]) {
        let [positions, speeds] = [self.simulation.positions(), self.simulation.speeds()];
        let joints = volts.iter().enumerate().map(|(module, volts)| {
            [0, 1, 2].map(|hinge| Joint {
                angle: positions[POSITIONS * module + HINGE_POSITION + hinge],
                speed: speeds[SPEEDS * module + HINGE_SPEED + hinge],
                volts: volts[hinge],
            })
        });
        self.history.keep(joints);
    }

    /// The trouble of a step with a warning. The solver computes all at once, so all numbers may be invalid,
    /// and the warning's index is only the first. The joint that turned fastest is named instead, if it is
    /// known.
    fn broken(&self, warning: Warning) -> Trouble {
        match self.history.wildest() {
            Some((module, hinge)) => self.trouble(module, Some(hinge), warning.what.into()),
            None => self.named(warning),
        }
    }

    /// The trouble of the number with the warning's index.
    fn named(&self, Warning { what, index }: Warning) -> Trouble {
        let (numbers, hinges) =
            if what.contains("position") { (POSITIONS, HINGE_POSITION) } else { (SPEEDS, HINGE_SPEED) };
        let [module, place] = [index / numbers, index % numbers];
        if module >= self.modules() {
            return Trouble {
                seconds: self.seconds(),
                place: "the model".into(),
                what: what.into(),
                last: vec![],
            };
        }
        self.trouble(module, place.checked_sub(hinges), what.into())
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
    fn expect_calm(&self) -> Result<(), Trouble> {
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

    /// Swaps two modules. Each gets the joint angles of the other, because it must be bent so to fit there.
    /// The docks that held one module then hold the other.
    pub fn swap(&mut self, one: usize, other: usize) {
        swap(self.simulation.positions_mut(), POSITIONS, one, other);
        swap(self.simulation.speeds_mut(), SPEEDS, one, other);
        for (index, weld) in self.welds.iter_mut().enumerate() {
            if let Some(weld) = weld {
                weld.swap(one, other, &mut self.simulation, index);
            }
        }
        self.simulation.update();
    }

    /// Turns each body of modules by `degrees` about its initial long axis, and lays it down where it is.
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
            * DAffine3::from_rotation_x(-degrees.to_radians())
            * DAffine3::from_translation(-middle);
        for &module in body {
            let frame = turn * weld::frame(&self.simulation, model::root(module));
            let (_, rotation, position) = frame.to_scale_rotation_translation();
            let place = &mut self.simulation.positions_mut()[POSITIONS * module..][..HINGE_POSITION];
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
    fn deepest(&self, modules: &[usize]) -> Option<(usize, f64)> {
        let standing = 1..self.ground_geoms;
        let contacts = self.simulation.contacts().filter(|contact| standing.contains(&contact.geoms[0]));
        let depths = contacts.map(|contact| (self.module_of(&contact), contact.depth));
        let deep = depths.filter(|(module, depth)| *depth > TOUCH && modules.contains(module));
        deep.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The body of a module that touches the ground in a contact.
    fn body_of(&self, contact: &Contact) -> usize {
        contact.geoms[0].max(contact.geoms[1]) + 1 - self.ground_geoms
    }

    fn module_of(&self, contact: &Contact) -> usize {
        model::module(self.body_of(contact))
    }

    /// Raises or lowers each of these bodies until its lowest corner touches the plane.
    fn put_on_ground(&mut self, bodies: &[Vec<usize>]) {
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
            self.simulation.positions_mut()[POSITIONS * module + 2] += height;
        }
    }

    /// The corners of a module's halves, in m.
    fn corners_of(&self, module: usize) -> impl Iterator<Item = DVec3> {
        let corners = model::corners();
        [Half::Front, Half::Back].into_iter().flat_map(move |half| {
            let frame = weld::frame(&self.simulation, model::half(module, half));
            corners[half as usize].map(|corner| frame.transform_point3(corner))
        })
    }

    /// The length of the robot along x, in m.
    pub fn length(&self) -> f64 {
        let corners = (0..self.modules()).flat_map(|module| self.corners_of(module));
        let (least, most) = corners.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), corner| {
            (least.min(corner.x), most.max(corner.x))
        });
        most - least
    }

    /// The number of modules.
    pub fn modules(&self) -> usize {
        self.motors.len()
    }

    /// The time since the beginning, in s.
    pub fn seconds(&self) -> f64 {
        self.steps as f64 * STEP_SECONDS
    }

    /// The angles of a module's joints, in rad.
    pub fn angles(&self, module: usize) -> [f64; 3] {
        let place = POSITIONS * module + HINGE_POSITION;
        [0, 1, 2].map(|hinge| self.simulation.positions()[place + hinge])
    }

    /// The speeds of a module's joints, in rad/s.
    pub fn speeds(&self, module: usize) -> [f64; 3] {
        let place = SPEEDS * module + HINGE_SPEED;
        [0, 1, 2].map(|hinge| self.simulation.speeds()[place + hinge])
    }

    /// The reading of an accelerometer without a filter in the half with the Front dock, along x, y and z of
    /// that half, in multiples of the acceleration of gravity.
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

    /// The pair of docks that hold each other and are the farthest apart, and their distance, in mm.
    fn farthest(&self) -> Option<([Face; 2], f64)> {
        let apart = self.welds.iter().flatten().map(|weld| (weld.faces, weld.error(&self.simulation).0));
        apart.max_by(|one, other| one.1.total_cmp(&other.1))
    }

    /// The largest errors of docks that are attached, in mm and in degrees.
    pub fn dock_error(&self) -> (f64, f64) {
        let errors = self.welds.iter().flatten().map(|weld| weld.error(&self.simulation));
        errors.fold((0.0, 0.0), |(far, turned), (mm, degrees)| (far.max(mm), turned.max(degrees)))
    }

    /// The frame of a module, in mm.
    pub fn frame(&self, module: usize) -> DAffine3 {
        let frame = weld::frame(&self.simulation, model::root(module));
        DAffine3 { translation: frame.translation / MILLI, ..frame }
    }

    /// The middle of a module, in m.
    pub fn place(&self, module: usize) -> DVec3 {
        self.simulation.pose(model::root(module)).0
    }

    /// The direction out of the Up side of a module's part at the roll.
    pub fn up(&self, module: usize) -> DVec3 {
        self.simulation.pose(model::root(module)).1 * DVec3::Z
    }

    /// The middle of all modules, in m.
    pub fn middle(&self) -> DVec3 {
        self.middle_of(&(0..self.modules()).collect::<Vec<_>>())
    }

    /// The middle of these modules, in m.
    fn middle_of(&self, modules: &[usize]) -> DVec3 {
        modules.iter().map(|&module| self.place(module)).sum::<DVec3>() / modules.len() as f64
    }

    /// The axes of all bodies, seen from above.
    pub(crate) fn axes(&self) -> Vec<[f64; 2]> {
        let turns =
            (0..model::BODIES * self.modules()).map(|body| self.simulation.pose(model::root(0) + body).1);
        turns
            .flat_map(|turn| [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turn * axis))
            .map(|axis| [axis.x, axis.y])
            .collect()
    }

    /// The motion of the robot so far.
    pub fn motion(&self) -> Motion {
        self.odometer.motion(self)
    }

    /// For each contact with the ground, the normal force, in N, and the speed at which the module slides
    /// there, in m/s.
    pub(crate) fn slides(&self) -> impl Iterator<Item = (f64, f64)> {
        self.simulation.contacts().map(|contact| {
            let velocity = self.simulation.velocity(self.body_of(&contact), contact.position);
            let along = velocity - contact.normal * velocity.dot(contact.normal);
            (contact.force, along.length())
        })
    }

    /// The numbers that make up the world's state.
    pub fn state(&self) -> impl Iterator<Item = f64> {
        self.simulation.positions().iter().chain(self.simulation.speeds()).copied()
    }
}

/// Swaps two blocks of `length` numbers.
fn swap(numbers: &mut [f64], length: usize, one: usize, other: usize) {
    for index in 0..length {
        numbers.swap(length * one + index, length * other + index);
    }
}
