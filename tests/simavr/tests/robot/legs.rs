//! Legs come off and are put on, and modules change places, while a centipede walks: robots/legs.toml, with
//! the images that it is flashed with, in the world and without, and natively.

use simavr_harness::{Engine, Ground, RobotBuilder};
use simulation::{Native, Robot, Run, Scenario, faults};
use superbot_tests_simavr::{MILLISECOND, firmware};

const SECOND: u64 = 1000 * MILLISECOND;
const PERIOD: u64 = SECOND;
const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;
const END: u64 = 17 * SECOND;

/// How long the slowest module takes to notice a change: one that a neighbour is gone.
const DISCOVERY: u64 = 300 * MILLISECOND;

/// The most Periods from a change until the gait is right.
const MOST_PERIODS: f64 = 1.3;

/// How many legs walk before the first event, and after each.
const LEGS: [usize; 9] = [6, 5, 4, 5, 6, 6, 6, 6, 6];

fn scenario() -> Scenario {
    Scenario::from_toml(include_str!("../../../../robots/legs.toml")).expect("the file is right")
}

fn simavr() -> RobotBuilder {
    RobotBuilder::wired(firmware(), &scenario().wiring).seed(1).power_up_within(POWER_UP_WITHIN)
}

fn engine(builder: RobotBuilder) -> Engine {
    Engine::new(builder.build().expect("it can be built"), 2)
}

/// Runs a robot through the file's events. Asserts that, a Period and the time of discovery after each, every
/// module knows its neighbours and its type, the gait is right, and all legs walk.
fn assert_comes_right<R: Robot>(robot: R, name: &str) -> Run<R> {
    let timeline = scenario().timeline;
    let moments: Vec<u64> = std::iter::once(0).chain(timeline.iter().map(|event| event.at)).collect();
    let mut run = Run::new(robot, timeline, PERIOD);
    for (at, legs) in moments.into_iter().zip(LEGS) {
        while run.step(at + PERIOD + DISCOVERY).expect("the events can happen") {}
        let after = format!("{name}, after what happens at {:.1} s", at as f64 / SECOND as f64);
        let modules = 0..run.robot.wiring().modules();
        let mistaken: Vec<usize> = modules.filter(|&module| !run.robot.is_right(module)).collect();
        assert_eq!(mistaken, [0; 0], "{after}");
        assert_eq!(run.observer.gait.first_violation(), None, "{after}");
        assert_eq!(run.observer.gait.legs(), legs, "{after}");
    }
    while run.step(END).expect("the events can happen") {}
    assert_eq!(run.events_to_come().len(), 0);
    assert_eq!(faults(&run, false), [""; 0], "{name}");
    let recovery = run.observer.gait.recovery_periods().expect("it was disturbed");
    assert!((0.1..=MOST_PERIODS).contains(&recovery), "{name}: {recovery} Periods");
    let lost_after = run.observer.discovery.lost_after.expect("neighbours went");
    assert!(lost_after <= DISCOVERY, "{name}: a loss noticed after {} ms", lost_after / MILLISECOND);
    run
}

#[test]
fn the_images_come_right() {
    assert_comes_right(engine(simavr()), "in simavr");
}

#[test]
fn natively_it_comes_right_whatever_the_seed() {
    for seed in 0..20 {
        assert_comes_right(
            Native::new(scenario().wiring, seed, POWER_UP_WITHIN),
            &format!("native, seed {seed}"),
        );
    }
}

/// It walks on while legs are carried from one branch to another, and parts of it change places.
#[test]
fn in_the_world_it_comes_right_and_walks_on() {
    let run = assert_comes_right(engine(simavr().on(Ground::default())), "in the world");
    let distance = run.robot.motion().expect("there is a world").distance;
    assert!(distance > 0.3, "{distance} m");
}
