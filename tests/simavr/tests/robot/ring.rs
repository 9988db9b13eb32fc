//! A chain of six that lies on its side becomes a ring and a chain again, by its own docks and guided by
//! infrared, in a physical world: robots/ring-on-side.toml.
//!
//! `SUPERBOT_ROBOTS=100` tries that many natively, and prints how each did: robots whose potentiometers have
//! slipped so that the ends miss each other by up to 20 mm along and across and by up to 10 degrees; such
//! robots whose gears have backlash, `SUPERBOT_BACKLASH=1` percent of the potentiometers' travel, or whose
//! hooks miss `SUPERBOT_HOOKS=50` percent of the docks that they reach; and robots whose potentiometers sit
//! turned on their shafts at random, by `SUPERBOT_TURNED=0.4` percent of that at most.

use std::fmt;

use hormone::action::Action;
use plants::geometry::{self, Dock as Place};
use simavr_harness::{Engine, Physics, RobotBuilder, Terrain, Variation};
use simulation::{Change, Event, MILLISECOND, Mcus, Native, Placing, Random, Robot, Run, Scenario};
use superbot_tests_simavr::{firmware, setting};

const SECOND: u64 = 1000 * MILLISECOND;

/// Modules get their power within this time.
const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;

/// Where the ends miss each other, the time of the order to open; and the time after that order by which the
/// robot has to be open.
const CLOSES: u64 = 30 * SECOND;
const OPENS: u64 = 4 * SECOND;

/// By how much ends miss each other at most: in mm along the tail's Back and across it, and in degrees.
const MISS: [f64; 3] = [20.0, 20.0, 10.0];

/// How often the test checks whether the ends have begun to seek each other.
const LOOK: u64 = 20 * MILLISECOND;

/// The result of a run.
struct Outcome {
    /// How far its ends were off when the head began to seek the tail: in mm along the tail's Back and across
    /// it, and in degrees. `None` if the tail had found it before.
    off: Option<[f64; 3]>,
    /// The robot's own changes of its wiring, each with its time in s.
    changes: Vec<(f64, Change)>,
}

impl Outcome {
    /// Whether it closed once and opened once.
    fn is_as_ordered(&self) -> bool {
        matches!(&self.changes[..], [(_, Change::Attach(..)), (_, Change::Detach(_))])
    }

    /// Whether it had closed by [`CLOSES`], however often it came apart before, and then opened once.
    fn ends_as_ordered(&self) -> bool {
        let closes = CLOSES as f64 / SECOND as f64;
        matches!(&self.changes[..], [.., (closed, Change::Attach(..)), (opened, Change::Detach(_))]
            if *closed < closes && *opened > closes)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.off {
            Some(off) => write!(f, "{} off", told(off))?,
            None => write!(f, "the head had not to look")?,
        }
        self.changes.iter().try_for_each(|(at, change)| write!(f, "; {at:.1} s: {change}"))
    }
}

/// The position of the head's Front relative to the tail's Back.
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
    let end = scenario.timeline.last().expect("it is ordered to open").at + OPENS;
    while run.robot.now() < end {
        run.step(end.min(run.robot.now() + LOOK)).expect("the events are possible");
        // The tail tries before, while the chain still bends.
        let seeks = run.robot.status(0).is_some_and(|status| status.action == Action::Reach);
        if seeks && ends.is_none() {
            ends = Some(off(&run.robot));
        }
        assert_eq!(run.robot.trouble(), None);
    }
    let seconds = |cycle: u64| cycle as f64 / SECOND as f64;
    let changes = run.observer.own_changes.iter().map(|event| (seconds(event.at), event.change.clone()));
    Outcome { off: ends, changes: changes.collect() }
}

fn scenario() -> Scenario {
    Scenario::from_toml(include_str!("../../../../robots/ring-on-side.toml")).expect("the file is right")
}

/// By how much the ends of the robot with this seed miss each other.
fn miss(seed: u64) -> [f64; 3] {
    let mut random = Random::new(seed);
    MISS.map(|most| most * random.between(-1.0, 1.0))
}

fn told([along, across, askew]: [f64; 3]) -> String {
    format!("{along:.0} mm, {across:.0} mm, {askew:.0} degrees")
}

/// Potentiometers that have slipped so that the ends of a chain of six that curls miss each other by this
/// much.
///
/// The joints that bend are the corners of a polygon of twelve sides, and the ends meet in the middle of one.
/// Of all errors of the joints with this effect, these have the least sum of squares:
/// `even + near cos + aside sin` of the angle at which a joint is seen from the middle of the ring, 0 where
/// the ends meet.
fn slips([along, across, askew]: [f64; 3]) -> impl Iterator<Item = Change> {
    let side = 84.0;
    let radius = side / (2.0 * 15_f64.to_radians().sin());
    let middle = radius * 15_f64.to_radians().cos();
    let askew = askew.to_radians();
    let even = askew / 12.0;
    let near = (middle * askew - along) / (6.0 * radius);
    let aside = across / (6.0 * radius);
    (0..6).map(move |module| {
        let error = |corner: usize| {
            let (sin, cos) = (15.0 + 30.0 * corner as f64).to_radians().sin_cos();
            (even + near * cos + aside * sin).to_degrees()
        };
        // A joint whose potentiometer reads too much bends too little.
        Change::Slip { module, degrees: [-error(2 * module), 0.0, -error(2 * module + 1)] }
    })
}

/// A robot whose ends miss each other by this much, and that has until [`CLOSES`] to close.
fn missing(miss: [f64; 3]) -> Scenario {
    let mut scenario = scenario();
    let open = scenario.timeline.last_mut().expect("it is ordered to open");
    open.at = CLOSES;
    scenario.timeline.splice(..0, slips(miss).map(|change| Event { at: 0, change }));
    scenario
}

fn natively(scenario: &Scenario, variations: &[Variation], seed: u64) -> Outcome {
    let world = Physics::on_terrain(&scenario.wiring, &Terrain::default(), variations, seed);
    let world = Box::new(world.expect("there is room"));
    outcome(Native::new(scenario.wiring.clone(), seed, POWER_UP_WITHIN).within(world), scenario)
}

#[test]
fn a_chain_on_its_side_becomes_a_ring_and_a_chain_again_natively() {
    let (robots, turned) =
        (setting("SUPERBOT_ROBOTS").unwrap_or(2), setting("SUPERBOT_TURNED").unwrap_or(0.0));
    let scenario = if turned > 0.0 { missing([0.0; 3]) } else { scenario() };
    let turned = variation("potentiometer", turned);
    let mut rings = 0;
    for seed in 1..=robots {
        let outcome = natively(&scenario, &[turned], seed);
        println!("{seed}: {outcome}");
        rings += u64::from(outcome.is_as_ordered());
    }
    println!("{rings} of {robots}");
    assert!(turned.percent > 0.0 || rings == robots, "{rings} of {robots}");
}

/// That of so many robots of this variation nearly all become rings, and chains again.
fn find_each_other(robots: u64, variation: Variation, is_right: impl Fn(&Outcome) -> bool) {
    let mut rings = 0;
    for seed in 1..=robots {
        let miss = miss(seed);
        let outcome = natively(&missing(miss), &[variation], seed);
        println!("{seed}: {}: {outcome}", told(miss));
        rings += u64::from(is_right(&outcome));
    }
    println!("{rings} of {robots} with {variation}");
    assert!(rings * 100 >= robots * 95, "{rings} of {robots}");
}

#[test]
fn ends_that_miss_each_other_find_each_other_natively() {
    let robots = setting("SUPERBOT_ROBOTS").unwrap_or(2);
    find_each_other(robots, variation("hooks", 0.0), Outcome::is_as_ordered);
}

#[test]
fn so_they_do_where_gears_have_backlash() {
    let backlash = variation("backlash", setting("SUPERBOT_BACKLASH").unwrap_or(0.6));
    find_each_other(setting("SUPERBOT_ROBOTS").unwrap_or(1), backlash, Outcome::is_as_ordered);
}

/// How often hooks miss in the tests.
fn misses() -> Variation {
    variation("hooks", setting("SUPERBOT_HOOKS").unwrap_or(50.0))
}

/// A latch that opens again, because its hooks have missed, may let go of a dock that has just caught it.
#[test]
fn so_they_do_where_hooks_miss() {
    find_each_other(setting("SUPERBOT_ROBOTS").unwrap_or(4), misses(), Outcome::ends_as_ordered);
}

/// It knows no neighbour for a moment, and then its beat again, while the head's dock approaches its own.
#[test]
fn a_tail_that_hears_no_neighbour_meanwhile_does_not_latch_together_with_the_head() {
    // The hooks of both docks of the fourth robot would miss at once.
    for seed in (4..).take(setting("SUPERBOT_ROBOTS").unwrap_or(1)) {
        let mut scenario = missing([0.0; 3]);
        let change = Change::Reset { module: 4, mcus: Mcus::Both };
        let place = scenario.timeline.len() - 1;
        scenario.timeline.insert(place, Event { at: 4185 * MILLISECOND, change });
        let outcome = natively(&scenario, &[misses()], seed);
        println!("{seed}: {outcome}");
        assert!(outcome.ends_as_ordered(), "{seed}: {outcome}");
    }
}

fn variation(of: &str, percent: f64) -> Variation {
    format!("{of}={percent}%").parse().expect("it is a variation")
}

fn by_its_images(scenario: &Scenario, variations: &[Variation], seed: u64) -> Outcome {
    let robot = RobotBuilder::wired(firmware(), &scenario.wiring).seed(seed).power_up_within(POWER_UP_WITHIN);
    let robot = robot.on_terrain(&Terrain::default()).varied(variations).build().expect("it can be built");
    outcome(Engine::new(robot, 1), scenario)
}

#[test]
fn a_chain_on_its_side_becomes_a_ring_and_a_chain_again_by_its_images() {
    let outcome = by_its_images(&scenario(), &[], 1);
    println!("{outcome}");
    assert!(outcome.is_as_ordered(), "{outcome}");
}

/// That of robots of these variations, with the seeds from `first` on, all become rings, and chains again.
fn find_each_other_by_images(first: u64, variations: &[Variation], is_right: impl Fn(&Outcome) -> bool) {
    for seed in (first..).take(setting("SUPERBOT_RINGS").unwrap_or(1)) {
        let miss = miss(seed);
        let outcome = by_its_images(&missing(miss), variations, seed);
        println!("{seed}: {}: {outcome}", told(miss));
        assert!(is_right(&outcome), "{outcome}");
    }
}

#[test]
fn ends_that_miss_each_other_find_each_other_by_their_images() {
    find_each_other_by_images(1, &[], Outcome::is_as_ordered);
}

#[test]
fn so_they_do_where_hooks_miss_by_their_images() {
    // The hooks of the third robot miss.
    find_each_other_by_images(3, &[misses()], Outcome::ends_as_ordered);
}
