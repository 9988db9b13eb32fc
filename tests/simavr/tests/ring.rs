//! A chain of six that lies on its side becomes a ring and a chain again, by its own docks and guided by
//! infrared, in a physical world: robots/ring-on-side.toml.
//!
//! `SUPERBOT_ROBOTS=40 SUPERBOT_TURNED=0.4` tries as many natively, whose potentiometers sit turned on their
//! shafts by so many percent of their travel at most, so that the ends do not meet where they think; and
//! tells how each did.

use std::str::FromStr;

use hormone::action::Action;
use plants::geometry::{self, Dock as Place};
use simavr_harness::{Engine, Physics, RobotBuilder, Terrain, Variation};
use simulation::{Change, MILLISECOND, Native, Placing, Robot, Run, Scenario};
use superbot_tests_simavr::firmware;

const SECOND: u64 = 1000 * MILLISECOND;

/// Modules get their power within this time.
const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;

/// When it has to be open again.
const END: u64 = 18 * SECOND;

/// How often it is looked at whether the ends begin to seek each other.
const LOOK: u64 = 20 * MILLISECOND;

/// What came of a robot.
struct Outcome {
    /// How far its ends were off when the tail began to seek the head: in mm along the tail's Back and across
    /// it, and in degrees.
    off: [f64; 3],
    /// When it changed its wiring itself, in s, and how.
    changes: Vec<(f64, Change)>,
}

impl Outcome {
    /// Whether it closed once and opened once.
    fn is_as_ordered(&self) -> bool {
        matches!(&self.changes[..], [(_, Change::Attach(..)), (_, Change::Detach(_))])
    }
}

/// How the head's Front lies before the tail's Back.
fn off(robot: &impl Robot) -> [f64; 3] {
    let dock = |module, dock: Place| {
        let Placing { frame, angles } = robot.placing(module).expect("there is a world");
        frame * dock.in_module(angles)
    };
    let fits = dock(5, Place::Back) * geometry::attached(Place::Back, Place::Front);
    let off = fits.inverse() * dock(0, Place::Front);
    // It bends about y.
    let turned = off.matrix3.x_axis.z.atan2(off.matrix3.x_axis.x).to_degrees();
    [off.translation.x, off.translation.z, turned]
}

fn outcome(robot: impl Robot, scenario: &Scenario) -> Outcome {
    let mut run = Run::new(robot, scenario.timeline.clone(), SECOND);
    let mut ends = None;
    while run.robot.now() < END {
        run.step(END.min(run.robot.now() + LOOK)).expect("the events are possible");
        let seeks = run.robot.status(5).is_some_and(|status| status.action == Action::Grasp);
        if seeks && ends.is_none() {
            ends = Some(off(&run.robot));
        }
        assert_eq!(run.robot.trouble(), None);
    }
    let seconds = |cycle: u64| cycle as f64 / SECOND as f64;
    let changes = run.observer.own_changes.iter().map(|event| (seconds(event.at), event.change.clone()));
    Outcome { off: ends.expect("it was ordered to close"), changes: changes.collect() }
}

fn scenario() -> Scenario {
    Scenario::from_toml(include_str!("../../../robots/ring-on-side.toml")).expect("the file is right")
}

/// A number out of the environment, or else this.
fn asked<T: FromStr>(name: &str, usual: T) -> T {
    std::env::var(name).ok().and_then(|number| number.parse().ok()).unwrap_or(usual)
}

#[test]
fn a_chain_on_its_side_becomes_a_ring_and_a_chain_again_natively() {
    let scenario = scenario();
    let (robots, turned) = (asked("SUPERBOT_ROBOTS", 2), asked("SUPERBOT_TURNED", 0.0));
    let turned: Variation = format!("potentiometer={turned}%").parse().expect("it is a variation");
    let mut rings = 0;
    for seed in 1..=robots {
        let world = Physics::on_terrain(&scenario.wiring, &Terrain::default(), &[turned], seed);
        let world = Box::new(world.expect("there is room"));
        let robot = Native::new(scenario.wiring.clone(), seed, POWER_UP_WITHIN).within(world);
        let outcome = outcome(robot, &scenario);
        let ([along, across, askew], changes) = (outcome.off, &outcome.changes);
        println!("{seed}: {along:.0} mm, {across:.0} mm, {askew:.0} degrees off: {changes:?}");
        rings += u64::from(outcome.is_as_ordered());
    }
    println!("{rings} of {robots}");
    assert!(turned.percent > 0.0 || rings == robots, "{rings} of {robots}");
}

#[test]
fn a_chain_on_its_side_becomes_a_ring_and_a_chain_again_by_its_images() {
    let scenario = scenario();
    let robot = RobotBuilder::wired(firmware(), &scenario.wiring).seed(1).power_up_within(POWER_UP_WITHIN);
    let robot = robot.on_terrain(&Terrain::default()).build().expect("it can be built");
    let outcome = outcome(Engine::new(robot, 2), &scenario);
    assert!(outcome.is_as_ordered(), "{:?}", outcome.changes);
}
