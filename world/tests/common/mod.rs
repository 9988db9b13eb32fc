//! Modules for the tests.

use glam::{DAffine3, DVec3};
use plants::geometry::Dock;
use world::{Face, Ground, Make, Placed, World};

/// A straight module at a position in mm.
pub fn at(x: f64, y: f64, z: f64) -> Placed {
    Placed { frame: DAffine3::from_translation(DVec3::new(x, y, z)), angles: [0.0; 3], make: Make::default() }
}

/// A straight chain, the head at the origin, the Back of each at the Front of the next.
pub fn chain(modules: usize) -> World {
    let placed: Vec<Placed> = (0..modules).map(|module| at(-168.0 * module as f64, 0.0, 0.0)).collect();
    let mut world = World::new(&placed, &Ground::default()).expect("a world");
    for module in 1..modules {
        world.attach(Face { module: module - 1, dock: Dock::Back }, Face { module, dock: Dock::Front });
    }
    world
}

/// Runs the world with the same volts at the motors of all modules.
pub fn run(world: &mut World, volts: [f64; 3], milliseconds: usize) {
    let volts = vec![volts; world.modules()];
    for _ in 0..milliseconds {
        world.step(&volts).expect("the world holds");
    }
}

/// FNV-1a over the bits of the state.
pub fn hash(world: &World) -> u64 {
    let bytes = world.state().flat_map(f64::to_le_bytes);
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}
