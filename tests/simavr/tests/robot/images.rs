//! A module with another image walks along with the rest; here its table of rules differs.

use std::sync::Arc;

use hormone::action::Action::{self, Holding, Swing};
use hormone::data::Data::A;
use hormone::event::Event;
use hormone::module_type::ModuleType::LeftLeg;
use hormone::rule::received;
use simavr_harness::{Engine, Image, Images, RobotBuilder};
use simulation::{Robot, Run, Shape, TraceEvent, faults};
use superbot_tests_simavr::rules::{Master, table::table};
use superbot_tests_simavr::{MILLISECOND, firmware};

const MODULES: usize = 10;
const END: u64 = 5_000 * MILLISECOND;

/// The left legs of both branches: the second has another image.
const LEGS: [usize; 2] = [2, 6];

/// The images of a module that never lifts a left leg: its rule for A says Holding.
fn lame() -> Images {
    let swings = received(LeftLeg, A).perform(Swing);
    let place = table().iter().position(|&rule| rule == swings).expect("left legs swing at A");
    let master = Image::parse(&Master::read().with(place, swings.perform(Holding)));
    Images { master: Arc::new(master.expect("it is an image")), ..firmware() }
}

/// A centipede of which these modules have the other image.
fn robot(lame_modules: &[usize]) -> Engine {
    let wiring = Shape::Centipede.wiring(MODULES).expect("it is long enough");
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(1);
    let robot = lame_modules.iter().fold(robot, |robot, &module| robot.program(module, lame()));
    Engine::new(robot.build().expect("it can be built"), 2)
}

/// The robot at the end of a run, and its trace events.
fn trace_events(lame_modules: &[usize]) -> (Engine, Vec<TraceEvent>) {
    let mut engine = robot(lame_modules);
    engine.run_until(END);
    let trace_events = engine.take_trace_events();
    (engine, trace_events)
}

fn actions(trace_events: &[TraceEvent], module: usize) -> Vec<Action> {
    let begun = |trace_event: &TraceEvent| match trace_event.event {
        Event::ActionBegun(action) if trace_event.module == module && action != Action::Rest => Some(action),
        _ => None,
    };
    trace_events.iter().filter_map(begun).collect()
}

#[test]
fn who_has_another_image_acts_by_its_rules_and_all_others_walk_on() {
    let [(_, alike), (engine, mixed)] = [trace_events(&[]), trace_events(&LEGS[1..])];
    assert!((0..MODULES).all(|module| engine.is_right(module)));
    for leg in LEGS {
        let [before, now] = [&alike, &mixed].map(|trace_events| actions(trace_events, leg));
        assert!(before.len() > 8 && before.contains(&Swing), "{before:?}");
        let expected = if leg == LEGS[1] { vec![Holding; before.len()] } else { before };
        assert_eq!(now, expected, "module {leg}");
    }
    // A leg sends no hormones, so the events of all other modules do not change.
    let others = |trace_events: Vec<TraceEvent>| {
        trace_events
            .into_iter()
            .filter(|trace_event| trace_event.module != LEGS[1])
            .map(|trace_event| (trace_event.module, trace_event.event))
    };
    assert!(others(mixed).eq(others(alike)));
}

#[test]
fn the_verdict_names_who_has_other_rules() {
    let mut run = Run::new(robot(&LEGS[1..]), Vec::new(), 1_000 * MILLISECOND);
    while run.step(END).expect("nothing happens") {}
    let [fault] = &faults(&run, false)[..] else { panic!("{:?}", faults(&run, false)) };
    assert!(fault.starts_with("the gait was wrong") && fault.contains("module 6 did"), "{fault}");
}
