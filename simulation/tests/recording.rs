//! The recording of a run holds all that happened, and the run is the same without it.

use hormone::action::Action;
use hormone::event::Event as Behaviour;
use hormone::gait::GaitName;
use hormone::module_type::ModuleType;
use simulation::{
    Change, Event, Face, Links, MILLISECOND, Native, Passage, Placing, Recording, Robot, Run, Scenario,
    Shape, View, Wiring,
};
use tasks::dock::Dock::{Back, Front, Left, Up};
use tasks::dock::{Dock, DockSet};

const EVERY: u64 = 40 * MILLISECOND;
const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;

fn centipede(timeline: Vec<Event>) -> Run<Native> {
    let wiring = Shape::Centipede.wiring(10).unwrap();
    let robot = Native::new(wiring, 1, POWER_UP_WITHIN);
    Run::new(robot, timeline, u64::from(GaitName::Centipede.gait().period()) * MILLISECOND)
}

fn finish(mut run: Run<Native>, milliseconds: u64) -> Run<Native> {
    while run.step(milliseconds * MILLISECOND).unwrap() {}
    run
}

/// The recording of a centipede of 10.
fn recorded(timeline: Vec<Event>, milliseconds: u64) -> Recording {
    let mut run = centipede(timeline);
    run.record(EVERY);
    finish(run, milliseconds).finish_recording().unwrap()
}

fn at(milliseconds: u64, change: Change) -> Event {
    Event { at: milliseconds * MILLISECOND, change }
}

#[test]
fn to_be_recorded_or_to_pause_changes_nothing() {
    let timeline = || {
        let loss = Change::Loss { links: Links::All, probability: 0.1 };
        vec![at(0, loss), at(2_130, Change::Detach(Face { module: 2, dock: Back }))]
    };
    let plain = finish(centipede(timeline()), 4_000);
    let mut run = centipede(timeline());
    // No divisor of the time between two looks of the observers.
    run.record(33 * MILLISECOND);
    let kept = finish(run, 4_000);
    let mut paused = centipede(timeline());
    for pause in 1.. {
        if !paused.step_until(4_000 * MILLISECOND, pause * 33 * MILLISECOND).unwrap() {
            break;
        }
    }
    let seen = |run: &Run<Native>| {
        let hops = &run.observer.hops;
        let gait = &run.observer.gait;
        (
            (hops.sent, hops.delivered, hops.dropped, hops.lost(), hops.latency()),
            run.observer.discovery.found_after,
            (gait.violations(), gait.skew_max),
        )
    };
    for other in [kept, paused] {
        assert_eq!(plain.robot.state_hash(), other.robot.state_hash());
        assert_eq!(seen(&plain), seen(&other));
    }
}

#[test]
fn it_is_looked_at_as_often_as_asked_from_power_up_to_the_end() {
    for (milliseconds, looks) in [(1_000, 26), (1_039, 26), (1_040, 27)] {
        assert_eq!(recorded(Vec::new(), milliseconds).placings.len(), looks * 10, "{milliseconds} ms");
    }
}

#[test]
fn hormones_are_those_that_were_counted() {
    let mut run = centipede(vec![at(1_000, Change::Loss { links: Links::All, probability: 0.3 })]);
    run.record(EVERY);
    let mut run = finish(run, 6_000);
    let Recording { hormones, .. } = run.finish_recording().unwrap();
    let hops = &run.observer.hops;
    assert_eq!(hormones.len() as u64, hops.sent);
    let arrived = hormones.iter().filter(|passage| passage.arrived.is_some()).count() as u64;
    assert_eq!(arrived, hops.delivered + hops.dropped);
    assert!(arrived > 0);
    assert!(hormones.is_sorted_by_key(|passage| passage.sent));
    assert!(hormones.iter().all(|passage| passage.arrived.is_none_or(|arrived| arrived > passage.sent)));
}

#[test]
fn a_hormone_into_a_cut_link_does_not_arrive() {
    let from = Face { module: 1, dock: Back };
    let whole = recorded(Vec::new(), 2_000).hormones;
    assert!(whole.iter().all(|passage| passage.arrived.is_some()), "{whole:?}");
    let sent = whole.iter().rfind(|passage| passage.from == from).unwrap().sent;
    let cut = Change::Loss { links: Links::From(from), probability: 1.0 };
    let cut = Event { at: sent - MILLISECOND, change: cut };
    let lost = recorded(vec![cut], 2_000).hormones.into_iter().filter(|passage| passage.arrived.is_none());
    assert_eq!(lost.map(|passage| passage.from).collect::<Vec<_>>(), [from]);
}

#[test]
fn joints_are_where_actions_bring_them() {
    let Recording { placings, trace_events, .. } = recorded(Vec::new(), 3_000);
    let lie = Shape::Centipede.wiring(10).unwrap().placings();
    assert_eq!(placings[..10], lie, "at power-up");
    let swings =
        |trace_event: &&simulation::TraceEvent| trace_event.event == Behaviour::ActionBegun(Action::Swing);
    let leg = trace_events.iter().find(swings).unwrap().module;
    let angles: Vec<_> =
        placings.iter().skip(leg).step_by(10).map(|Placing { angles, .. }| angles[2]).collect();
    let postures: Vec<f64> = Action::Swing.motion().iter().map(|posture| f64::from(posture.motor2)).collect();
    assert!(postures.iter().all(|hip| angles.contains(hip)), "{postures:?} in {angles:?}");
}

#[test]
fn a_robot_without_a_world_turns_as_it_is_rolled() {
    let Recording { placings, .. } = recorded(vec![at(500, Change::Roll(90.0))], 600);
    let left = |look: usize| placings[10 * look].frame.matrix3.y_axis;
    assert_eq!(left(12), glam::DVec3::Y);
    assert!(left(13).abs_diff_eq(glam::DVec3::Z, 1e-9), "its left side goes up: {}", left(13));
}

#[test]
fn each_body_without_a_world_turns_where_it_lies() {
    let robot = Native::new(Wiring::new(2), 1, POWER_UP_WITHIN);
    let mut run = Run::new(robot, vec![at(20, Change::Roll(90.0))], 1_000 * MILLISECOND);
    run.record(EVERY);
    let Recording { placings, .. } = finish(run, 60).finish_recording().unwrap();
    for module in [0, 1] {
        let [before, after] = [placings[module], placings[2 + module]].map(|placing| placing.frame);
        assert_eq!(before.translation, after.translation, "module {module}");
        assert!(after.matrix3.y_axis.abs_diff_eq(glam::DVec3::Z, 1e-9), "its left side goes up: {after}");
    }
}

#[test]
fn modules_come_to_know_their_neighbours_and_forget_them() {
    let wiring = Shape::Centipede.wiring(10).unwrap();
    let detached = Face { module: 1, dock: Left };
    let at_dock = wiring.peer(detached).unwrap();
    let recording = recorded(vec![at(1_000, Change::Detach(detached))], 2_000);
    let known = |until: usize, module: usize| {
        let of_module = |view: &&View| view.look <= until && view.module == module;
        recording.views.iter().rfind(of_module).map(|&View { docks, .. }| docks)
    };
    let attached = |module: usize| {
        let mut docks = DockSet::EMPTY;
        let faces = Dock::ALL.into_iter().filter(|&dock| wiring.peer(Face { module, dock }).is_some());
        faces.for_each(|dock| docks.insert(dock));
        docks
    };
    for module in 0..10 {
        assert_eq!(known(0, module), None, "{module}");
        assert_eq!(known(24, module), Some(attached(module)), "{module}");
    }
    assert_eq!(known(50, at_dock.module), Some(DockSet::EMPTY));
    let module_type = |until: usize, module: usize| {
        let of_module = |view: &&View| view.look <= until && view.module == module;
        recording.views.iter().rfind(of_module)?.module_type
    };
    assert_eq!((module_type(24, 0), module_type(24, 2)), (Some(ModuleType::Head), Some(ModuleType::LeftLeg)));
    assert_eq!(module_type(50, at_dock.module), Some(ModuleType::Other));
    let [(0, first), (then, second)] = &recording.wirings[..] else { panic!("{:?}", recording.wirings) };
    assert_eq!((first, *then), (&wiring, 1_000 * MILLISECOND));
    assert_eq!(second.peer(detached), None);
}

#[test]
fn a_module_that_never_had_neighbours_knows_what_it_is() {
    let mut run = Run::new(Native::new(Wiring::new(1), 1, 0), Vec::new(), 1_000 * MILLISECOND);
    run.record(EVERY);
    let views = finish(run, 500).finish_recording().unwrap().views;
    assert_eq!(views.last().map(|view| view.module_type), Some(Some(ModuleType::Other)), "{views:?}");
}

#[test]
fn what_happens_is_said_in_words() {
    let face = Face { module: 1, dock: Up };
    let Scenario { timeline, .. } = Scenario::from_toml(
        "modules = 10\nshape = \"centipede\"\n[[event]]\nat = 0.1\nloss = 0.07\n[[event]]\nat = 0.2\nkill = 4\n",
    )
    .unwrap();
    let recording =
        recorded([timeline, vec![at(300, Change::Obstacle { at: face, is_there: true })]].concat(), 500);
    let words: Vec<_> =
        recording.happenings.iter().map(|(at, text)| (at / MILLISECOND, text.as_str())).collect();
    assert_eq!(
        words,
        [
            (100, "7 % of frames lost on all links"),
            (200, "the power of module 4 fails"),
            (300, "an obstacle before 1.Up"),
        ]
    );
    assert_eq!(recording.losses, None, "natively nobody counts frames that are lost");
    assert_eq!(recording.wirings.last().unwrap().1.peer(Face { module: 4, dock: Front }), None);
}

#[test]
fn parts_of_a_run_are_the_whole_of_it() {
    let timeline = || {
        let loss = Change::Loss { links: Links::All, probability: 0.2 };
        vec![at(500, loss), at(2_500, Change::Kill(3))]
    };
    let whole = recorded(timeline(), 4_000);
    let mut run = centipede(timeline());
    run.record(EVERY);
    let mut parts = Vec::new();
    for look in 1.. {
        let goes_on = run.step_until(4_000 * MILLISECOND, look * EVERY).unwrap();
        let now = run.robot.now();
        parts.push(run.observer.recorder.as_mut().unwrap().news(now));
        if !goes_on {
            break;
        }
    }
    parts.extend(run.finish_recording());
    let hormones: Vec<_> = parts.iter().flat_map(|part| part.hormones.clone()).collect();
    let sorted = |hormones: &[Passage]| {
        let mut hormones = hormones.to_vec();
        hormones.sort_by_key(|passage| (passage.sent, passage.from.module, passage.from.dock.index()));
        hormones
    };
    assert_eq!(sorted(&hormones), sorted(&whole.hormones));
    assert!(whole.hormones.iter().any(|passage| passage.arrived.is_none()), "some are lost");
    macro_rules! compare {
        ($($list:ident)*) => {$(
            let of_parts: Vec<_> = parts.iter().flat_map(|part| part.$list.clone()).collect();
            assert_eq!(of_parts, whole.$list, stringify!($list));
        )*};
    }
    compare!(placings trace_events views wirings happenings);
    assert!(parts.iter().filter(|part| !part.placings.is_empty()).count() > 40, "it comes as it goes on");
}

#[test]
fn what_happens_by_hand_is_as_if_it_had_stood_in_the_timeline() {
    let pull = Change::Detach(Face { module: 2, dock: Back });
    let planned = finish(centipede(vec![at(1_120, pull.clone())]), 2_000);
    let mut by_hand = centipede(Vec::new());
    while by_hand.robot.now() < 1_120 * MILLISECOND {
        by_hand.step_until(2_000 * MILLISECOND, 1_120 * MILLISECOND).unwrap();
    }
    assert!(by_hand.happen(Change::Detach(Face { module: 0, dock: Front })).is_err());
    by_hand.happen(pull).unwrap();
    let by_hand = finish(by_hand, 2_000);
    assert_eq!(by_hand.robot.state_hash(), planned.robot.state_hash());
    assert_eq!(by_hand.observer.discovery.lost_after, planned.observer.discovery.lost_after);
    assert!(planned.observer.discovery.lost_after.is_some());
}
