//! Docks of a link that share one light: each hears what it sends itself, unless it is on pins, and where
//! both send at once, neither is understood.

use simavr_harness::{Engine, RobotBuilder};
use simulation::{Change, Event, Face, LinkTotals, MILLISECOND, Native, Robot, Run, Shape, is_on_pins};
use superbot_tests_simavr::firmware;
use tasks::dock::Dock;

const SECOND: u64 = 1_000 * MILLISECOND;
const MODULES: usize = 20;
const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;

/// Runs a centipede for two seconds, and checks that all came as it should.
fn walked<R: Robot>(robot: R) -> Run<R> {
    let event = Event { at: 0, change: Change::SharedLight(true) };
    let mut run = Run::new(robot, vec![event], SECOND);
    while run.step(2 * SECOND).expect("the event can happen") {}
    let mistaken: Vec<usize> = (0..MODULES).filter(|&module| !run.robot.is_right(module)).collect();
    assert_eq!(mistaken, []);
    let lost = run.observer.hops.lost();
    assert_eq!((run.observer.discovery.lapses, run.observer.gait.violations(), lost), (0, 0, 0));
    assert_eq!((run.robot.links().gave_up, run.robot.bridges().gave_up), (0, 0));
    run
}

fn by_images(seed: u64, threads: usize) -> Run<Engine> {
    let wiring = Shape::Centipede.wiring(MODULES).expect("there is one");
    let builder = RobotBuilder::wired(firmware(), &wiring).seed(seed).power_up_within(POWER_UP_WITHIN);
    walked(Engine::new(builder.build().expect("it can be built"), threads))
}

#[test]
fn each_usart_hears_what_it_sends_and_nobody_who_has_no_neighbour_hears_anything() {
    let run = by_images(1, 2);
    let robot = run.robot.robot();
    for from in (0..MODULES).flat_map(|module| Dock::ALL.map(|dock| Face { module, dock })) {
        let module = robot.module(from.module).expect("it is there");
        let counters = module.link_counters(from.dock).expect("each dock has a link");
        if robot.neighbour(from).is_none() {
            assert_eq!((counters.frames_received, counters.errors), (0, 0), "{from}");
        } else if is_on_pins(from.dock) {
            assert_eq!(counters.reflections, 0, "{from} is on pins, and deaf while it sends");
        } else {
            assert!((1..=counters.frames_sent).contains(&counters.reflections), "{from}: {counters:?}");
            let drowned = counters.frames_sent - counters.reflections;
            assert!(drowned <= counters.errors + 1, "{from}: {counters:?}");
        }
    }
}

/// At a stop modules are together, wherever in a window that is.
#[test]
fn neither_threads_nor_stops_change_anything_of_it() {
    let outcome = |threads, step: u64| {
        let robot = RobotBuilder::chain(firmware(), 4).seed(2).build();
        let mut engine = Engine::new(robot.expect("it can be built"), threads);
        engine.change(&Change::SharedLight(true)).expect("it can happen");
        while engine.cycle() < SECOND {
            engine.run_until((engine.cycle() + step).min(SECOND));
        }
        (engine.state_hash(), engine.links())
    };
    let expected = outcome(1, SECOND);
    assert_eq!(outcome(2, SECOND), expected);
    assert_eq!(outcome(1, 7_919), expected);
    assert_eq!(outcome(1, 50_021), expected);
}

/// The native engine takes two frames that overlap for drowned; simavr adds their bits.
#[test]
fn both_engines_repeat_about_as_many_frames() {
    let sum = |links: fn(u64) -> LinkTotals| (1..=5).map(|seed| links(seed).retries).sum::<u64>();
    let by_images = sum(|seed| by_images(seed, 2).robot.links());
    let natively = sum(|seed| {
        let wiring = Shape::Centipede.wiring(MODULES).expect("there is one");
        walked(Native::new(wiring, seed, POWER_UP_WITHIN)).robot.links()
    });
    assert!(by_images.abs_diff(natively) < natively / 4, "{by_images} and {natively} frames");
    assert!(natively > 100, "{natively} frames");
}
