//! A centipede that is turned over walks on, with the images that it is flashed with: robots/turned.toml.

use hormone::action::Action::{self, Holding, HoldingOver, Straight, SwingOver};
use hormone::event::Event as Behaviour;
use simavr_harness::{Engine, RobotBuilder};
use simulation::{Native, Robot, Run, Scenario, TraceEvent};
use superbot_tests_simavr::{MILLISECOND, firmware};

const SECOND: u64 = 1000 * MILLISECOND;
const PERIOD: u64 = SECOND;
const END: u64 = 12 * SECOND;

/// The legs, left and right of each branch, and the modules between them.
const LEGS: [usize; 4] = [2, 3, 6, 7];
const TRUNK: [usize; 5] = [0, 1, 4, 5, 8];

/// From its turn until the robot lifts its feet the other way: the beat after the next one that asks.
const TURNED_AFTER: u64 = PERIOD;

fn scenario() -> Scenario {
    Scenario::from_toml(include_str!("../../../../robots/turned.toml")).expect("the file is right")
}

fn simavr(seed: u64, threads: usize) -> Engine {
    let robot =
        RobotBuilder::wired(firmware(), &scenario().wiring).seed(seed).power_up_within(40 * MILLISECOND);
    Engine::new(robot.build().expect("it can be built"), threads)
}

/// Runs a robot through the file's events, and calls `look` at the times `looks`, in order.
fn run<R: Robot>(robot: R, looks: &[u64], mut look: impl FnMut(&R)) -> Run<R> {
    let mut run = Run::new(robot, scenario().timeline, PERIOD);
    for &at in looks {
        while run.step(at).expect("the events can happen") {}
        look(&run.robot);
    }
    while run.step(END).expect("the events can happen") {}
    run
}

/// By leg, the actions that began, with their times.
fn trace_events(mut robot: impl Robot) -> Vec<Vec<(u64, Action)>> {
    let mut timeline = scenario().timeline.into_iter().peekable();
    while robot.now() < END {
        if let Some(event) = timeline.next_if(|event| event.at <= robot.now()) {
            robot.change(&event.change).expect("it can happen");
        }
        robot.run_until(robot.now() + 100 * MILLISECOND);
    }
    let trace_events = robot.take_trace_events();
    let of_leg = |leg| {
        let begun = |trace_event: &TraceEvent| match trace_event.event {
            Behaviour::ActionBegun(action) if trace_event.module == leg => Some((trace_event.cycle, action)),
            _ => None,
        };
        trace_events.iter().filter_map(begun).collect()
    };
    LEGS.map(of_leg).to_vec()
}

fn assert_walks_on(run: &Run<impl Robot>) {
    let gait = &run.observer.gait;
    assert_eq!((gait.legs(), gait.violations()), (LEGS.len(), 0));
    assert!(gait.recovery_periods().is_some_and(|periods| periods <= 1.0), "{:?}", gait.recovery_periods());
}

#[test]
fn a_centipede_that_is_turned_over_walks_on() {
    let hashes = [1, 2].map(|threads| {
        let run = run(simavr(1, threads), &[], |_| {});
        assert_walks_on(&run);
        run.robot.state_hash()
    });
    assert_eq!(hashes[0], hashes[1], "whatever the number of threads");
    for seed in 1..9 {
        assert_walks_on(&run(Native::new(scenario().wiring, seed, 40 * MILLISECOND), &[], |_| {}));
    }
}

/// While the robot lies on its back every leg swings the other way, and none does before or after.
#[test]
fn each_leg_lifts_its_foot_as_it_lies_in_both_engines() {
    let [over, back] = [0, 1].map(|event| scenario().timeline[event].at);
    let native = Native::new(scenario().wiring, 1, 40 * MILLISECOND);
    for acts in [trace_events(simavr(1, 2)), trace_events(native)].concat() {
        // Before the first beat a module rests.
        let acts: Vec<_> = acts.into_iter().filter(|act| act.1 != Action::Rest).collect();
        assert!(acts.len() > 20);
        for pair in acts.windows(2) {
            let ((at, action), (next_at, next)) = (pair[0], pair[1]);
            assert!((next_at - at).abs_diff(PERIOD / 2) < 20 * MILLISECOND, "{pair:?}");
            let holds = |action| matches!(action, Holding | HoldingOver);
            assert_ne!(holds(action), holds(next), "{pair:?}");
        }
        for (at, action) in acts {
            let is_over = matches!(action, SwingOver | HoldingOver);
            let expected: &[bool] = match at {
                _ if at < over => &[false],
                _ if at < over + TURNED_AFTER => &[false, true],
                _ if at < back => &[true],
                _ if at < back + TURNED_AFTER => &[false, true],
                _ => &[false],
            };
            assert!(expected.contains(&is_over), "{action:?} after {} ms", at / MILLISECOND);
        }
    }
}

/// How far a leg's foot and hip turned, each way.
#[derive(Clone, Copy, Default)]
struct Turned {
    foot: [f64; 2],
    hip: [f64; 2],
}

/// The joints carry it out: feet press down towards the ground and are lifted again, hips swing ahead as
/// before, and the trunk stays straight.
#[test]
fn feet_press_on_the_ground_on_the_side_that_is_down() {
    // On its feet, and on its back: once the legs have rolled upright, and the change is over.
    let spans = [3 * SECOND..4 * SECOND, 6 * SECOND..8 * SECOND];
    let looks: Vec<u64> =
        spans.iter().flat_map(|span| span.clone().step_by(50 * MILLISECOND as usize)).collect();
    let mut seen = [[Turned::default(); LEGS.len()]; 2];
    run(simavr(1, 2), &looks, |engine| {
        let angles = |module| engine.robot().module(module).expect("it is there").body().angles();
        let span = usize::from(engine.cycle() >= spans[1].start);
        for (turned, leg) in seen[span].iter_mut().zip(LEGS) {
            let [foot, _, hip] = angles(leg);
            for ([least, most], angle) in [(&mut turned.foot, foot), (&mut turned.hip, hip)] {
                (*least, *most) = (least.min(angle), most.max(angle));
            }
        }
        for module in TRUNK {
            assert_eq!(engine.status(module).map(|status| status.action), Some(Straight));
            assert!(angles(module).into_iter().all(|angle| angle.abs() < 1.0), "module {module}");
        }
    });
    for (over, legs) in seen.into_iter().enumerate() {
        for Turned { foot: [least, most], hip: [behind, ahead] } in legs {
            let [lifted, pressed] = if over == 1 { [-least, -most] } else { [most, least] };
            assert!(lifted > -5.0 && pressed < -15.0, "foot from {least} to {most}");
            assert!(behind < -10.0 && ahead > 10.0, "hip from {behind} to {ahead}");
        }
    }
}
