//! Compares the two engines: simavr with the images, and the native one with its model of times. Types, the
//! order of hormones and the actions of legs must be the same, also when the robot is turned over, and times
//! must be close.

use hormone::action::Action;
use hormone::event::Event;
use hormone::module_type::ModuleType;
use simavr_harness::{Engine, Physics, RobotBuilder};
use simulation::{Change, Hops, Motion, Native, Robot, Run, Scenario, Shape, Terrain};
use superbot_tests_simavr::{MILLISECOND, firmware};

/// How long robots run, and how often modules are sampled: never when a beat is due.
const END: u64 = 5_000 * MILLISECOND;
const LOOK: u64 = 100 * MILLISECOND;

/// Before this modules may still look for their neighbours, and chance decides who has found them.
const DISCOVERY: u64 = 150 * MILLISECOND;

/// Modules get their power within this time, in both engines at the same moments.
const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;

/// How far apart in time the engines may handle a hormone, for each hop: a probe may be in the way in one
/// engine and not in the other.
const APART_PER_HOP: u64 = 3 * MILLISECOND;

/// How far apart their mean hop latencies may be, in parts of the longer.
const LATENCY_APART: f64 = 0.06;

/// No more than one in so many hormones is repeated in either engine, over all seeds. A frame is lost here
/// only when both ends send at once, and chance decides when they do. At first, while links are new and
/// probed quickly, that happens more often.
const FEW_REPEATED: u64 = 20;
const FEW_REPEATED_AT_FIRST: u64 = 10;
const AT_FIRST: u64 = 1_000 * MILLISECOND;

/// How much a robot's distance in a world may differ, as a fraction of that in simavr, and the time for it.
const WAY_APART: f64 = 0.1;
const WALK: u64 = 7_000 * MILLISECOND;

/// When the robot is turned, and by how much: in the middle of a beat, and not when modules are sampled.
const TURNS: [(u64, f64); 2] = [(2_230 * MILLISECOND, 180.0), (3_730 * MILLISECOND, 0.0)];

/// The observations of a robot.
struct Seen {
    /// By module, the events of HORMONE, and when.
    hormones: Vec<Vec<(Event, u64)>>,
    /// By module, its type and its action, in each sample after discovery.
    looks: Vec<Vec<(ModuleType, Action)>>,
    hops: Hops,
    /// Frames repeated: at first, and later.
    repeated: [u64; 2],
}

fn watch(mut robot: impl Robot, turns: &[(u64, f64)]) -> Seen {
    let modules = robot.wiring().modules();
    let mut seen = Seen {
        hormones: vec![Vec::new(); modules],
        looks: vec![Vec::new(); modules],
        hops: Hops::new(modules),
        repeated: [0; 2],
    };
    while robot.now() < END {
        let next = robot.now()..robot.now() + LOOK;
        for &(at, degrees) in turns.iter().filter(|turn| next.contains(&turn.0)) {
            robot.run_until(at);
            robot.change(&Change::Roll(degrees)).expect("any robot can be turned");
        }
        robot.run_until(next.end);
        for trace_event in robot.take_trace_events() {
            seen.hops.take(&trace_event, robot.wiring());
            if !matches!(trace_event.event, Event::TopologyChanged(_) | Event::ActionBegun(Action::Rest)) {
                seen.hormones[trace_event.module].push((trace_event.event, trace_event.cycle));
            }
        }
        if robot.now() <= AT_FIRST {
            seen.repeated[0] = robot.links().retries;
        }
        if robot.now() < DISCOVERY {
            continue;
        }
        for (module, looks) in seen.looks.iter_mut().enumerate() {
            let status = robot.status(module).expect("the program runs");
            looks.push((status.module_type, status.action));
        }
    }
    seen.repeated[1] = robot.links().retries - seen.repeated[0];
    seen
}

/// The same robot in both engines: simavr's first.
fn both(shape: Shape, modules: usize, seed: u64, turns: &[(u64, f64)]) -> [Seen; 2] {
    let wiring = shape.wiring(modules).expect("the shape has so many modules");
    let builder = RobotBuilder::wired(firmware(), &wiring).seed(seed).power_up_within(POWER_UP_WITHIN);
    let engine = Engine::new(builder.build().expect("the robot can be built"), 2);
    [watch(engine, turns), watch(Native::new(wiring, seed, POWER_UP_WITHIN), turns)]
}

fn assert_alike(shape: Shape, modules: usize, turns: &[(u64, f64)]) {
    // For each engine: frames repeated at first and later, and hormones delivered.
    let mut repeated = [([0; 2], 0); 2];
    for seed in 1..=3 {
        let [simavr, native] = both(shape, modules, seed, turns);
        for module in 0..modules {
            let name = format!("module {module} of {modules}, seed {seed}");
            assert_eq!(simavr.looks[module], native.looks[module], "{name}");
            let what = |seen: &Seen| seen.hormones[module].iter().map(|did| did.0).collect::<Vec<_>>();
            assert_eq!(what(&simavr), what(&native), "{name}");
            for (one, other) in simavr.hormones[module].iter().zip(&native.hormones[module]) {
                let apart = one.1.abs_diff(other.1);
                assert!(apart <= modules as u64 * APART_PER_HOP, "{name}: {one:?} {other:?}");
            }
        }
        for (([at_first, later], delivered), seen) in repeated.iter_mut().zip([&simavr, &native]) {
            *at_first += seen.repeated[0];
            *later += seen.repeated[1];
            *delivered += seen.hops.delivered;
        }
        let [simavr, native] = [simavr, native].map(|seen| seen.hops);
        assert_eq!((simavr.sent, simavr.delivered), (native.sent, native.delivered));
        let [simavr, native] = [simavr, native].map(|hops| hops.latency().expect("hormones came").0);
        let apart = (simavr - native).abs() / simavr.max(native);
        assert!(apart <= LATENCY_APART, "seed {seed}: hop latencies {simavr} and {native} cycles");
    }
    for ([at_first, later], delivered) in repeated {
        assert!(at_first * FEW_REPEATED_AT_FIRST <= delivered, "{at_first} at first, {delivered} hormones");
        assert!(later * FEW_REPEATED <= delivered, "{later} frames repeated, {delivered} hormones");
    }
}

#[test]
fn a_centipede_does_the_same_in_both_engines() {
    assert_alike(Shape::Centipede, 18, &[]);
}

#[test]
fn a_chain_does_the_same_in_both_engines() {
    assert_alike(Shape::Chain, 10, &[]);
}

#[test]
fn a_centipede_that_is_turned_over_and_back_does_the_same_in_both_engines() {
    assert_alike(Shape::Centipede, 10, &TURNS);
}

/// How a robot has moved through the events of its file, in a world.
fn motion(robot: impl Robot, scenario: &Scenario) -> Motion {
    let mut run = Run::new(robot, scenario.timeline.clone(), 1_000 * MILLISECOND);
    while run.step(WALK).expect("the events are possible") {}
    assert_eq!(run.robot.trouble(), None);
    assert!((0..run.robot.wiring().modules()).all(|module| run.robot.is_right(module)));
    run.robot.motion().expect("there is a world")
}

#[test]
fn in_a_world_robots_come_as_far_in_both_engines() {
    for file in [
        "shape = 'centipede'\nmodules = 10",
        include_str!("../../../../robots/gaits/caterpillar.toml"),
        include_str!("../../../../robots/gaits/serpentine.toml"),
        include_str!("../../../../robots/broken-joints.toml"),
    ] {
        let scenario = Scenario::from_toml(file).expect("the file is right");
        let wiring = &scenario.wiring;
        let builder = RobotBuilder::wired(firmware(), wiring).seed(1).power_up_within(POWER_UP_WITHIN);
        let robot = builder.on_terrain(&Terrain::default()).build().expect("the robot can be built");
        let simavr = motion(Engine::new(robot, 2), &scenario);
        let world = Physics::on_terrain(wiring, &Terrain::default(), &[], 1).expect("there is room");
        let native = Native::new(wiring.clone(), 1, POWER_UP_WITHIN).within(Box::new(world));
        let native = motion(native, &scenario);
        let apart = (native.distance - simavr.distance).abs();
        assert!(simavr.distance > 0.1, "{file}: {simavr:?}");
        assert!(apart < WAY_APART * simavr.distance, "{file}: {} and {} m", simavr.distance, native.distance);
    }
}
