//! Checks that joints and docks change neither the momentum nor the angular momentum of modules that fall.

use crate::common::at;
use glam::{DAffine3, DQuat, DVec3};
use plants::geometry::{Dock, EDGE};
use plants::motor::SUPPLY_VOLTS;
use world::assumed::{GRAVITY, MODULE_MASS, SHELL, SLIMMER};
use world::{Face, Ground, STEP_SECONDS, World};

/// A box of a module: its edges in m, and the frame at its middle, in m.
struct Part {
    edges: DVec3,
    frame: DAffine3,
}

/// A module that lies on the ground, and two that fall. These are 8 mm apart, and pull each other together.
fn falling() -> World {
    let mut world = World::new(
        &[at(0.0, 2000.0, 0.0), at(0.0, 0.0, 9000.0), at(-176.0, 0.0, 9000.0)],
        &Ground::default(),
    )
    .expect("a world");
    world.attach(Face { module: 1, dock: Dock::Back }, Face { module: 2, dock: Dock::Front });
    world
}

/// The boxes of the modules that fall.
fn parts(world: &World, rolls: [f64; 3]) -> Vec<Part> {
    let length = EDGE / 2.0 - SHELL;
    let [outer, inner] = [length, length - SLIMMER].map(|half| DVec3::new(length, 2.0 * half, 2.0 * half));
    let of_module = |module| {
        let [front, back] = [Dock::Front, Dock::Back].map(|dock| world.dock(Face { module, dock }));
        let root = world.frame(module);
        let roll = root * DAffine3::from_rotation_x(rolls[module]);
        let inwards = -SHELL - length / 2.0;
        let ends = [(outer, front, inwards), (outer, back, inwards)];
        ends.into_iter().chain([(inner, root, length / 2.0), (inner, roll, -length / 2.0)])
    };
    let part = |(edges, frame, along): (DVec3, DAffine3, f64)| {
        let frame = frame * DAffine3::from_translation(DVec3::X * along);
        Part { edges: edges * 1e-3, frame: DAffine3 { translation: frame.translation * 1e-3, ..frame } }
    };
    [1, 2].into_iter().flat_map(of_module).map(part).collect()
}

/// The middle of all boxes, which have the same mass, in m.
fn centre(parts: &[Part]) -> DVec3 {
    parts.iter().map(|part| part.frame.translation).sum::<DVec3>() / parts.len() as f64
}

/// The angular momentum of each box about the centre of all, in kg m²/s, as a box moved in a step.
fn angular_momenta(before: &[Part], after: &[Part]) -> Vec<DVec3> {
    let mass = MODULE_MASS / 4.0;
    let [from, to] = [before, after].map(centre);
    let of_part = |(before, after): (&Part, &Part)| {
        let [from, to] = [before.frame.translation - from, after.frame.translation - to];
        let turn = DQuat::from_mat3(&(after.frame.matrix3 * before.frame.matrix3.transpose()));
        let turning = before.frame.matrix3.transpose() * turn.to_scaled_axis() / STEP_SECONDS;
        let squares = before.edges * before.edges;
        let inertia = mass / 12.0 * (DVec3::splat(squares.element_sum()) - squares);
        mass * (from + to).cross(to - from) / 2.0 / STEP_SECONDS + before.frame.matrix3 * (inertia * turning)
    };
    before.iter().zip(after).map(of_part).collect()
}

/// The angles of all rolls, in rad.
fn rolls(world: &World) -> [f64; 3] {
    [0, 1, 2].map(|module| world.angles(module)[1])
}

#[test]
fn motors_and_docks_change_no_momentum() {
    let mut world = falling();
    let mut before = parts(&world, rolls(&world));
    let began = centre(&before);
    let volts = [0.0, 0.6, 1.0].map(|share| share * SUPPLY_VOLTS);
    let mut most = 0.0_f64;
    for step in 0..500 {
        // Frames are those at the beginning of a step, angles those at its end.
        let rolls = rolls(&world);
        world.step(&[[0.0; 3], volts, [-volts[2], volts[2], volts[1]]]).expect("the world holds");
        let after = parts(&world, rolls);
        let seconds = f64::from(step) * STEP_SECONDS;
        let fallen = GRAVITY * seconds * (seconds + STEP_SECONDS) / 2.0;
        let off = centre(&after) - began + DVec3::Z * fallen;
        let momenta = angular_momenta(&before, &after);
        most = momenta.iter().map(|of_part| of_part.length()).fold(most, f64::max);
        let sum = momenta.iter().sum::<DVec3>();
        assert!(off.length() < 5e-6, "{off} m after {seconds} s");
        assert!(sum.length() < 5e-6, "{sum} kg m²/s after {seconds} s");
        before = after;
    }
    assert!(most > 5e-4, "boxes turn against each other: {most} kg m²/s");
    assert!(world.dock_error().0 < 0.1, "docks have come together");
}
