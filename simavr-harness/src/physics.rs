//! The world that a robot is in, and the data that the two exchange each millisecond.

use std::collections::HashMap;

use plants::dock::{SIGHT, hears};
use plants::geometry;
use simulation::{
    Body, Change, Environment, Face, Facing, Hooks, JointFault, JointOf, Motion, Noise, PUSH_MILLISECONDS,
    Placing, Terrain, Wiring, fnv_1a,
};
use world::assumed::ACCELEROMETER_HZ;
use world::{Ground, Make, Placed, STEP_SECONDS, Trouble, World, WorldError};

use crate::terrain;
use crate::tilt::Tilt;
use crate::variation::{Variation, vary};

/// Steps between two measurements of how far the robot leans: 10 ms.
const LOOK: u64 = 10;

/// The world, and the robot as the world has it: the volts at its motors, and which docks hold each other.
///
/// A step uses the volts of the millisecond before, so that it can be computed while the MCUs run through the
/// same millisecond. A motor's motion therefore shows at its potentiometer a millisecond later than without a
/// world.
pub struct Physics {
    world: World,
    /// By module.
    makes: Vec<Make>,
    /// By module, the volts at its motors in the next step.
    volts: Vec<[f64; 3]>,
    /// By module, the reading of its accelerometer, after the filter.
    accelerations: Vec<[f64; 3]>,
    roll: f64,
    tilt: Tilt,
    /// Milliseconds.
    steps: u64,
    trouble: Option<Trouble>,
}

impl Physics {
    /// A world in which the robot, of modules of these makes, lies as it does at power-up.
    ///
    /// # Errors
    /// There is no world for such a robot, or on this ground.
    pub fn new(wiring: &Wiring, ground: &Ground, makes: &[Make]) -> Result<Self, WorldError> {
        let placings = wiring.placings();
        let placed = |(&Placing { frame, angles }, &make)| Placed { frame, angles, make };
        let placed: Vec<Placed> = placings.iter().zip(makes).map(placed).collect();
        let mut world = World::new(&placed, ground)?;
        wiring.attachments().for_each(|(one, other)| world.attach(place(one), place(other)));
        let modules = wiring.modules();
        let accelerations = (0..modules).map(|module| world.acceleration(module)).collect();
        let mut tilt = Tilt::default();
        tilt.wired(wiring);
        let volts = vec![[0.0; 3]; modules];
        let makes = makes.to_vec();
        Ok(Physics { world, makes, volts, accelerations, roll: 0.0, tilt, steps: 0, trouble: None })
    }

    /// A world as a robot file describes it, with its variations from module to module drawn from `seed`.
    ///
    /// # Errors
    /// There is no world for such a robot, or on this ground.
    pub fn on_terrain(
        wiring: &Wiring,
        terrain: &Terrain,
        variations: &[Variation],
        seed: u64,
    ) -> Result<Self, WorldError> {
        let mut makes = terrain::makes(terrain, wiring.modules());
        vary(&mut makes, variations, seed);
        Physics::new(wiring, &terrain::ground(terrain), &makes)
    }

    /// The distance between the middles of two docks, in mm.
    pub fn distance(&self, one: Face, other: Face) -> f64 {
        let [one, other] = [one, other].map(|face| self.world.dock(place(face)).translation);
        one.distance(other)
    }

    /// The middle of a module, in m.
    pub fn place(&self, module: usize) -> [f64; 3] {
        self.world.place(module).to_array()
    }
}

impl Environment for Physics {
    fn enter(&mut self, module: usize, body: &mut Body) {
        let Make { motor, zeros, noise, noise_seed, misses, hooks_seed, .. } = self.makes[module];
        body.equip(motor, zeros, Noise::new(noise, noise_seed), Hooks::new(misses, hooks_seed));
        self.exchange(module, body);
    }

    fn exchange(&mut self, module: usize, body: &mut Body) {
        self.volts[module] = body.take_volts();
        let [angles, speeds] = [self.world.angles(module), self.world.speeds(module)];
        body.put(angles, speeds, self.accelerations[module]);
    }

    fn step(&mut self) {
        if self.trouble.is_some() {
            return;
        }
        self.trouble = self.world.step(&self.volts).err();
        self.steps += 1;
        if self.steps.is_multiple_of(LOOK) {
            self.tilt.look(&self.world, self.roll);
        }
        let share = 1.0 - (-2.0 * std::f64::consts::PI * ACCELEROMETER_HZ * STEP_SECONDS).exp();
        for (module, filtered) in self.accelerations.iter_mut().enumerate() {
            let read = self.world.acceleration(module);
            filtered
                .iter_mut()
                .zip(read)
                .for_each(|(filtered, read)| *filtered += share * (read - *filtered));
        }
    }

    fn change(&mut self, change: &Change, before: &Wiring, wiring: &Wiring) {
        match *change {
            Change::Swap(one, other) => self.world.swap(one, other),
            Change::Push { module, newtons } => self.world.push(module, newtons, PUSH_MILLISECONDS),
            Change::Fault { joint: JointOf { module, axis }, fault } => {
                self.world.jam(module, axis.index().into(), fault == JointFault::Jammed);
            }
            Change::Roll(degrees) => {
                self.world.turn_over(degrees - self.roll);
                self.roll = degrees;
            }
            _ => {
                let (old, new) = (before.attachments(), wiring.attachments());
                for (one, _) in old.filter(|(one, other)| wiring.attached(*one) != Some(*other)) {
                    self.world.detach(place(one));
                }
                for (one, other) in new.filter(|(one, other)| before.attached(*one) != Some(*other)) {
                    self.world.attach(place(one), place(other));
                }
            }
        }
        self.tilt.wired(wiring);
    }

    fn facing(&self, wiring: &Wiring, from: Face) -> Vec<Facing> {
        let dock = |face: Face| (place(face).dock, self.world.dock(place(face)));
        let own = dock(from);
        let others = (0..wiring.modules())
            .flat_map(|module| tasks::dock::Dock::ALL.map(|dock| Face { module, dock }))
            .filter(|&face| face != from && wiring.attached(face).is_none());
        let facing = others.filter_map(|face| {
            let (millimetres, degrees) = geometry::before(own, dock(face))?;
            Some(Facing { face, millimetres, degrees })
        });
        facing.collect()
    }

    fn in_sight(&self, wiring: &Wiring) -> HashMap<Face, Face> {
        let is_free = |face: &Face| wiring.attached(*face).is_none() && wiring.has_power(face.module);
        let dock = |face: Face| (face, (place(face).dock, self.world.dock(place(face))));
        let free: Vec<_> = wiring.docks().filter(is_free).map(dock).collect();
        let pairs = free.iter().filter_map(|&(from, own)| {
            // Most docks are far away, which takes less time to find out than how they lie.
            let near = free.iter().filter(|(face, (_, there))| {
                *face != from && own.1.translation.distance_squared(there.translation) <= SIGHT * SIGHT
            });
            let lies = near.filter_map(|&(face, there)| Some((face, geometry::before(own, there)?)));
            let hearing = lies.filter(|(_, (millimetres, degrees))| hears(*millimetres, *degrees));
            let nearest = hearing.min_by(|(_, one), (_, other)| one.0.total_cmp(&other.0));
            Some((from, nearest?.0))
        });
        pairs.collect()
    }

    fn trouble(&self) -> Option<&Trouble> {
        self.trouble.as_ref()
    }

    fn motion(&self) -> Motion {
        self.world.motion()
    }

    fn tilt(&self) -> f64 {
        self.tilt.most()
    }

    fn placing(&self, module: usize) -> Placing {
        let angles = self.world.angles(module).map(f64::to_degrees);
        Placing { frame: self.world.frame(module), angles }
    }

    fn state_hash(&self) -> u64 {
        fnv_1a(self.world.state().flat_map(f64::to_le_bytes))
    }
}

/// A dock as the world names it.
fn place(Face { module, dock }: Face) -> world::Face {
    world::Face { module, dock: geometry::Dock::ALL[usize::from(dock.index())] }
}

#[cfg(test)]
mod tests {
    use simulation::Shape;
    use tasks::dock::Dock;

    use super::*;

    #[test]
    fn free_docks_that_face_each_other_hear_each_other_if_both_have_power() {
        let mut wiring = Shape::Chain.wiring(3).unwrap();
        let mut physics = Physics::new(&wiring, &Ground::default(), &[Make::default(); 3]).unwrap();
        let mut change = |change: Change| {
            let before = wiring.clone();
            change.apply(&mut wiring).unwrap();
            physics.change(&change, &before, &wiring);
            physics.in_sight(&wiring)
        };
        let [one, other] = [(0, Dock::Back), (1, Dock::Front)].map(|(module, dock)| Face { module, dock });
        assert_eq!(change(Change::Roll(0.0)), HashMap::new());
        assert_eq!(change(Change::Detach(one)), HashMap::from([(one, other), (other, one)]));
        assert_eq!(change(Change::Kill(0)), HashMap::new());
    }
}
