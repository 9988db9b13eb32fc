//! Robots with the images that they are flashed with, in a physical world.

use simavr_harness::{Engine, Ground, RobotBuilder};
use simulation::{Change, Face, Robot, Shape};
use superbot_tests_simavr::{MILLISECOND, firmware};
use tasks::dock::Dock;
use tasks::motor::Axis;

const SECOND: u64 = 1000 * MILLISECOND;

fn centipede(modules: usize, seed: u64, threads: usize) -> Engine {
    let wiring = Shape::Centipede.wiring(modules).unwrap();
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(seed).power_up_within(40 * MILLISECOND);
    Engine::new(robot.on(Ground::default()).build().unwrap(), threads)
}

/// Where the joints of a module are, in degrees.
fn angles(engine: &Engine, module: usize) -> [f64; 3] {
    engine.robot().module(module).unwrap().body().angles()
}

#[test]
fn threads_change_nothing_and_the_seed_does() {
    let hash = |seed, threads| {
        let mut engine = centipede(6, seed, threads);
        // Not at the end of a millisecond, nor of a window.
        for end in [SECOND / 3, 1_500 * MILLISECOND + 1] {
            engine.run_until(end);
        }
        engine.state_hash()
    };
    let one = hash(1, 1);
    assert_eq!(one, hash(1, 2));
    assert_eq!(one, hash(1, 3));
    assert_ne!(one, hash(2, 2));
}

#[test]
fn how_often_a_run_is_interrupted_changes_nothing() {
    let run = |step: u64| {
        let mut engine = centipede(2, 1, 1);
        while engine.cycle() < SECOND {
            engine.run_until((engine.cycle() + step).min(SECOND));
        }
        engine.state_hash()
    };
    assert_eq!(run(SECOND), run(7_777));
}

#[test]
fn legs_turn_to_where_they_are_told_against_the_ground() {
    let mut engine = centipede(6, 1, 2);
    engine.run_until(4 * SECOND);
    for leg in [2, 3] {
        let [_, roll, _] = angles(&engine, leg);
        assert!((65.0..115.0).contains(&roll), "leg {leg} has rolled to {roll}");
    }
    let [_, roll, _] = angles(&engine, 4);
    assert!(roll.abs() < 5.0, "the spine is at {roll}");
}

#[test]
fn who_is_turned_over_feels_it() {
    let mut engine = centipede(6, 1, 2);
    let up = |engine: &Engine| engine.robot().module(1).unwrap().body().acceleration()[2];
    engine.run_until(SECOND);
    assert!(up(&engine) > 0.5, "{}", up(&engine));
    engine.change(&Change::Roll(180.0)).unwrap();
    engine.run_until(2 * SECOND);
    assert!(up(&engine) < -0.5, "{}", up(&engine));
}

#[test]
fn what_is_detached_stays_behind_and_can_be_joined_again() {
    let mut engine = centipede(10, 1, 2);
    engine.run_until(3 * SECOND);
    let [one, other] = [Face { module: 8, dock: Dock::Back }, Face { module: 9, dock: Dock::Front }];
    engine.change(&Change::Detach(one)).unwrap();
    engine.run_until(4 * SECOND);
    assert!(engine.trouble().is_none());
    let gap = |engine: &Engine| engine.robot().distance(one, other).unwrap();
    let before = gap(&engine);
    engine.change(&Change::Attach(one, other)).unwrap();
    // At 30 mm/s.
    engine.run_until(engine.cycle() + 4 * SECOND);
    assert!(engine.trouble().is_none());
    assert!(before > 5.0 && gap(&engine) < 1.0, "{before} mm, then {}", gap(&engine));
}

#[test]
fn modules_that_change_places_take_their_joints_with_them() {
    let mut engine = centipede(6, 1, 1);
    engine.run_until(3 * SECOND);
    let before = [2, 4].map(|module| angles(&engine, module));
    engine.change(&Change::Swap(2, 4)).unwrap();
    engine.run_until(engine.cycle() + 2 * MILLISECOND);
    let roll = usize::from(Axis::Roll.index());
    assert!((angles(&engine, 4)[roll] - before[0][roll]).abs() < 1.0);
    assert!((angles(&engine, 2)[roll] - before[1][roll]).abs() < 1.0);
    engine.run_until(engine.cycle() + SECOND);
    assert!(engine.trouble().is_none());
}
