//! A robot that changes its shape by its own docks, with the images that it is flashed with:
//! robots/ring.toml.

use hormone::action::Action::{Curl, Grasp, Roll, Wave};
use hormone::event::Event as Behaviour;
use hormone::module_type::ModuleType::{Head, Spine, Tail};
use simavr_harness::{Engine, RobotBuilder};
use simulation::{Change, Event, Face, Native, Robot, Run, Scenario, TraceEvent};
use superbot_tests_simavr::{MILLISECOND, firmware};
use tasks::dock::Dock::{Back, Front};

const SECOND: u64 = 1000 * MILLISECOND;
const MODULES: usize = 6;

/// Times after the order by which the ring is closed, and by which it rolls.
const CLOSED: u64 = 6 * SECOND;
const ROLLS: u64 = 12 * SECOND;

/// Times after the order by which the ring is open, and by which the chain crawls.
const OPEN: u64 = 4 * SECOND;
const CRAWLS: u64 = 6 * SECOND;

/// A robot, the events of its file, and its trace events and own changes so far.
struct Story {
    engine: Engine,
    timeline: Vec<Event>,
    trace_events: Vec<TraceEvent>,
    changes: Vec<Event>,
}

impl Story {
    fn of(text: &str, seed: u64, threads: usize) -> Self {
        let Scenario { wiring, timeline, .. } = Scenario::from_toml(text).expect("the file is right");
        let robot = RobotBuilder::wired(firmware(), &wiring).seed(seed).build().expect("it can be built");
        Story { engine: Engine::new(robot, threads), timeline, trace_events: Vec::new(), changes: Vec::new() }
    }

    fn ring(seed: u64, threads: usize) -> Self {
        Self::of(include_str!("../../../../robots/ring.toml"), seed, threads)
    }

    /// When event `number` of the file happens.
    fn ordered_at(&self, number: usize) -> u64 {
        self.timeline[number].at
    }

    fn run_until(&mut self, cycle: u64) {
        let from = self.engine.cycle();
        for Event { at, change } in self.timeline.clone() {
            if (from..cycle).contains(&at) {
                self.engine.run_until(at);
                self.engine.robot_mut().change(&change).expect("it can happen");
            }
        }
        self.engine.run_until(cycle);
        self.trace_events.extend(self.engine.take_trace_events());
        self.changes.extend(self.engine.take_changes());
    }

    /// Asserts that every module knows its neighbours and its type, and performs this action.
    fn all_do(&self, action: hormone::action::Action) {
        for module in 0..self.engine.robot().modules() {
            assert!(self.engine.is_right(module), "module {module}");
            assert_eq!(
                self.engine.status(module).map(|status| status.action),
                Some(action),
                "module {module}"
            );
        }
    }

    fn count(&self, wanted: hormone::module_type::ModuleType) -> usize {
        let modules = 0..self.engine.robot().modules();
        modules.filter(|&module| self.engine.wiring().module_type(module) == wanted).count()
    }

    /// The sum of the angles of all joints that bend, in degrees.
    fn bend(&self) -> f64 {
        let modules = (0..MODULES).filter_map(|module| self.engine.robot().module(module));
        modules.map(|module| module.body().angles()).map(|[front, _, back]| front + back).sum()
    }
}

#[test]
fn a_chain_becomes_a_ring_and_a_chain_again() {
    for seed in [1, 2] {
        let mut story = Story::ring(seed, 2);
        let [close, open] = [1, 2].map(|number| story.ordered_at(number));
        story.run_until(close);
        story.all_do(Wave);
        assert_eq!([story.count(Head), story.count(Spine), story.count(Tail)], [1, 4, 1]);

        story.run_until(close + CLOSED);
        let [Event { change, .. }] = &story.changes[..] else { panic!("{:?}", story.changes) };
        let ends = (Face { module: 5, dock: Back }, Face { module: 0, dock: Front });
        assert_eq!(*change, Change::Attach(ends.0, ends.1));
        assert_eq!(story.count(Spine), MODULES);

        story.run_until(close + ROLLS);
        let from = story.engine.cycle() - 2 * SECOND;
        let led = |trace_event: &&TraceEvent| {
            trace_event.cycle >= from && matches!(trace_event.event, Behaviour::HormoneGenerated(_))
        };
        let mut leaders: Vec<usize> =
            story.trace_events.iter().filter(led).map(|trace_event| trace_event.module).collect();
        leaders.dedup();
        let [leader] = leaders[..] else { panic!("one leads, not {leaders:?}") };
        let mut bends = Vec::new();
        for _ in 0..12 {
            story.run_until(story.engine.cycle() + 250 * MILLISECOND);
            story.all_do(Roll);
            assert!((story.bend() - 360.0).abs() <= 60.0, "{}", story.bend());
            bends.push(story.engine.robot().module(0).expect("it is there").body().angles()[0]);
        }
        let [least, most] = [f64::min, f64::max].map(|of| bends.iter().copied().reduce(of).unwrap_or(0.0));
        assert!(most - least > 50.0, "the bend runs round the ring: {bends:?}");

        story.run_until(open + OPEN);
        let change = story.changes.last().map(|event| &event.change);
        assert_eq!(change, Some(&Change::Detach(Face { module: leader, dock: Front })));
        story.run_until(open + CRAWLS);
        story.all_do(Wave);
        assert_eq!(story.changes.len(), 2);
        assert_eq!(story.engine.wiring().module_type(leader), Head);
    }
}

/// A module is reset while the chain closes, another while the ring opens, and a head and its neighbour while
/// all crawl. The native engine is disturbed at many more moments: simulation/tests.
#[test]
fn resets_at_any_time_change_nothing_of_what_becomes_of_the_robot() {
    let mut text = String::from(include_str!("../../../../robots/ring.toml"));
    for (at, module) in [(6.0, 1), (20.6, 1), (29.0, 0), (29.0, 1)] {
        text += &format!("\n[[event]]\nat = {at}\nreset = {module}\n");
    }
    let mut story = Story::of(&text, 1, 2);
    // The first reset lies between both orders.
    let [close, open] = [1, 3].map(|number| story.ordered_at(number));
    story.run_until(close + ROLLS);
    story.all_do(Roll);
    for seconds in [8, 12] {
        story.run_until(open + seconds * SECOND);
        story.all_do(Wave);
    }
}

/// A chain of five bends, finds nothing to grasp, and tries again.
#[test]
fn ends_that_do_not_meet_stay_apart() {
    let mut story =
        Story::of(&include_str!("../../../../robots/ring.toml").replace("modules = 6", "modules = 5"), 1, 1);
    let close = story.ordered_at(1);
    story.run_until(close + 10 * SECOND);
    let tail =
        story.trace_events.iter().filter(|trace_event| trace_event.module == 4 && trace_event.cycle > close);
    let mut actions: Vec<_> = tail
        .filter_map(|trace_event| match trace_event.event {
            Behaviour::ActionBegun(action @ (Curl | Grasp)) => Some(action),
            _ => None,
        })
        .collect();
    actions.dedup();
    assert_eq!(actions, [Curl, Grasp, Curl, Grasp, Curl]);
    assert!(story.changes.is_empty());
    assert_eq!([story.count(Head), story.count(Spine), story.count(Tail)], [1, 3, 1]);
}

#[test]
fn the_number_of_threads_makes_no_difference() {
    let closed = |threads| {
        let mut story = Story::ring(1, threads);
        story.run_until(story.ordered_at(1) + CLOSED);
        story
    };
    let [one, two] = [closed(1), closed(2)];
    assert_eq!(one.changes.len(), 1);
    assert_eq!(one.changes, two.changes);
    assert_eq!(one.engine.state_hash(), two.engine.state_hash());
}

/// The native engine, which has no latches and whose joints take no time, makes the same changes at the same
/// times.
#[test]
fn both_engines_tell_the_same_story() {
    let Scenario { wiring, timeline, .. } =
        Scenario::from_toml(include_str!("../../../../robots/ring.toml")).expect("the file is right");
    let mut run = Run::new(Native::new(wiring, 1, 0), timeline, SECOND);
    let mut story = Story::ring(1, 2);
    let end = story.ordered_at(2) + OPEN;
    story.run_until(end);
    while run.step(end).expect("the events can happen") {}
    let [simavr, native] = [&story.changes, &run.observer.own_changes];
    assert_eq!((simavr.len(), native.len()), (2, 2));
    for (one, other) in simavr.iter().zip(native) {
        assert!(one.at.abs_diff(other.at) <= 50 * MILLISECOND, "{one:?} {other:?}");
    }
    // Chance decides which module leads the ring, and lets go.
    assert_eq!(simavr[0].change, native[0].change);
}
