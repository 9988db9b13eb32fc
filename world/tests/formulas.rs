//! Compares the world with closed formulas.

use crate::common::{at, run};
use plants::geometry::EDGE;
use plants::motor::{GEAR_INERTIA, Motor, SLIDING_FRICTION, SUPPLY_VOLTS};
use world::assumed::{FRICTION, GRAVITY, MODULE_MASS, SHELL};
use world::{Ground, World};

fn near(value: f64, expected: f64, tolerance: f64) {
    let error = (value - expected).abs() / expected.abs();
    assert!(error <= tolerance, "{value} is not {expected} to {tolerance}");
}

/// A module on the ground, and one that falls from 20 m beside it.
fn falling() -> World {
    World::new(&[at(0.0, 0.0, 0.0), at(0.0, 1000.0, 20_000.0)], &Ground::default()).unwrap()
}

#[test]
fn a_module_falls_by_half_the_square_of_the_time() {
    let mut world = falling();
    let before = world.front(1).translation.z;
    run(&mut world, [0.0; 3], 1000);
    near((before - world.front(1).translation.z) / 1000.0, GRAVITY / 2.0, 0.002);
}

#[test]
fn falling_it_weighs_nothing_and_lying_what_it_weighs() {
    let mut world = falling();
    run(&mut world, [0.0; 3], 200);
    assert!(world.acceleration(1).iter().all(|axis| axis.abs() < 1e-6), "{:?}", world.acceleration(1));
    let [x, y, z] = world.acceleration(0);
    assert!(x.abs() < 1e-3 && y.abs() < 1e-3 && (z - 1.0).abs() < 1e-3, "{x} {y} {z}");
}

#[test]
fn a_push_gives_a_module_the_speed_that_its_mass_takes_and_ends() {
    let (mut world, newtons) = (falling(), 10.0);
    run(&mut world, [0.0; 3], 50);
    let before = world.front(1).translation;
    world.push(1, [0.0, newtons, 0.0], 200);
    run(&mut world, [0.0; 3], 500);
    let way = (world.front(1).translation - before) / 1000.0;
    let acceleration = newtons / MODULE_MASS;
    near(way.y, acceleration * (0.2 * 0.2 / 2.0 + 0.2 * 0.3), 0.01);
    assert!(way.x.abs() < 1e-3, "{way}");
}

fn on_slope(slope: f64) -> World {
    let mut world = World::new(&[at(0.0, 0.0, 0.0)], &Ground { slope, ..Ground::default() }).unwrap();
    run(&mut world, [0.0; 3], 1000);
    world
}

#[test]
fn a_module_slides_down_a_slope_by_what_friction_leaves_of_gravity() {
    let slope = 45.0_f64;
    let (sin, cos) = slope.to_radians().sin_cos();
    near(-on_slope(slope).motion().distance, GRAVITY * (sin - FRICTION * cos) / 2.0, 0.02);
}

#[test]
fn below_the_angle_of_friction_it_stays() {
    let slope = 0.9 * FRICTION.atan().to_degrees();
    assert!(on_slope(slope).motion().distance.abs() < 1e-3, "{:?}", on_slope(slope).motion());
}

/// The inertia that the motor of the roll turns in a floating module: that of the gear, and that of two equal
/// halves against each other.
fn inertia() -> f64 {
    let edge = (EDGE - 2.0 * SHELL) * 1e-3;
    let half = MODULE_MASS / 2.0 * (edge * edge + edge * edge) / 12.0;
    GEAR_INERTIA + half / 2.0
}

#[test]
fn a_step_of_voltage_turns_a_joint_by_the_formula_of_a_motor() {
    let mut world = falling();
    let milliseconds = 60;
    run(&mut world, [0.0, SUPPLY_VOLTS, 0.0], milliseconds);
    let seconds = milliseconds as f64 * 1e-3;
    // I w' = T - F - B w from rest.
    let motor = Motor::default();
    let standing = motor.torque(motor.amperes(SUPPLY_VOLTS, 0.0));
    let final_speed = (standing - SLIDING_FRICTION) / motor.braking();
    let constant = inertia() / motor.braking();
    near(world.speeds(1)[1], final_speed, 0.005);
    near(world.angles(1)[1], final_speed * (seconds - constant), 0.02);
}

#[test]
fn friction_holds_what_pulls_too_little_and_lets_go_of_more() {
    let motor = Motor::default();
    for (share, holds) in [(0.9, true), (1.1, false)] {
        let mut world = falling();
        let volts = share * motor.static_friction() / motor.torque(motor.amperes(1.0, 0.0));
        run(&mut world, [0.0, volts, 0.0], 500);
        assert_eq!(world.angles(1)[1].to_degrees() < 0.1, holds, "{share}: {:?}", world.angles(1));
    }
}

#[test]
fn a_joint_alone_and_one_in_the_world_turn_alike() {
    let mut world = falling();
    let mut joint = plants::joint::Joint::at(0.0);
    joint.surroundings.load_inertia = inertia() - GEAR_INERTIA;
    for (duty, milliseconds) in [(0.6, 300), (-1.0, 200), (0.0, 100)] {
        run(&mut world, [0.0, duty * SUPPLY_VOLTS, 0.0], milliseconds);
        (0..10 * milliseconds).for_each(|_| joint.step(duty, 1e-4));
        let difference = world.angles(1)[1].to_degrees() - joint.degrees();
        assert!(difference.abs() < 0.2, "{duty}: {difference} degrees apart of {}", joint.degrees());
    }
}
