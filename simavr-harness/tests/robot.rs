//! Tests modules that are attached to each other: their communication, and that only the seed decides
//! the outcome of a run.

use crate::common::build_with;
use simavr_harness::{
    Controller, Engine, Event, Face, Faults, Images, LinkCounts, Pin, Robot, RobotBuilder, RobotError,
    WiringError,
};
use simulation::{Change, Links, Run};
use tasks::dock::Dock;

const MILLISECOND: u64 = 16_000;

/// The relay at 38400 baud.
fn relay() -> Images {
    relay_at(51)
}

/// The relay with this divisor (UBRR): a bit takes 8 * (UBRR + 1) cycles.
fn relay_at(divisor: u8) -> Images {
    let divisor = format!("DIVISOR={divisor}");
    let build = |role| build_with("relay.c", &[role, &divisor, "WORK=20"]);
    Images { master: build("MASTER"), slave: build("SLAVE") }
}

/// A chain that relays packets from its first module.
fn chain(images: &Images, modules: usize, seed: u64) -> Robot {
    let mut robot = RobotBuilder::chain(images.clone(), modules).seed(seed).build().unwrap();
    let first = robot.module_mut(0).unwrap().mcu_mut(Controller::Slave);
    first.drive_pin(Pin { port: 'A', bit: 7 }, true);
    robot
}

fn back_of(module: usize) -> Face {
    Face { module, dock: Dock::Back }
}

fn front_of(module: usize) -> Face {
    Face { module, dock: Dock::Front }
}

/// The hop counts that the masters marked, by module.
fn hops(events: &[Event], modules: usize) -> Vec<Vec<u8>> {
    let of_module = |module| {
        let marked = events.iter().filter(|event| event.module == module);
        marked.map(|event| event.value).collect()
    };
    (0..modules).map(of_module).collect()
}

#[test]
fn the_wiring_of_a_chain() {
    let robot = RobotBuilder::chain(relay(), 3).build().unwrap();
    for module in 0..3 {
        for dock in Dock::ALL {
            let expected = match dock {
                Dock::Front if module > 0 => Some(back_of(module - 1)),
                Dock::Back if module < 2 => Some(front_of(module + 1)),
                _ => None,
            };
            assert_eq!(robot.neighbour(Face { module, dock }), expected);
        }
    }
}

#[test]
fn an_impossible_wiring_is_refused() {
    let build = |one, other| -> Result<Robot, RobotError> {
        RobotBuilder::chain(relay(), 2).attach(one, other).build()
    };
    let result = build(back_of(1), front_of(2));
    assert!(matches!(result, Err(RobotError::Wiring(WiringError::NoSuchModule { module: 2, modules: 2 }))));
    let result = build(front_of(0), front_of(1));
    assert!(matches!(
        result,
        Err(RobotError::Wiring(WiringError::DockInUse { module: 1, dock: Dock::Front }))
    ));
    for dock in [front_of(1), back_of(1)] {
        let result = build(back_of(1), dock);
        assert!(matches!(result, Err(RobotError::Wiring(WiringError::ModuleToItself { module: 1 }))));
    }
    assert!(build(back_of(1), front_of(0)).is_ok(), "a ring");
}

#[test]
fn packets_run_down_the_chain() {
    let mut engine = Engine::new(chain(&relay(), 4, 0), 1);
    engine.run_until(210 * MILLISECOND);
    let events = engine.take_events();
    assert!(events.is_sorted());
    assert_eq!(hops(&events, 4), [vec![], vec![1; 10], vec![2; 10], vec![3; 10]]);
    let counts = engine.robot().link_counts(back_of(0)).unwrap();
    assert_eq!(counts, LinkCounts { bytes: 30, frames: 10, ..LinkCounts::default() });
    let bus = engine.robot().module(1).unwrap().bus_counts();
    assert_eq!(bus.bytes, 10 * 3);
    assert!(engine.take_events().is_empty());
    assert_eq!(engine.robot().crashes().count(), 0);
}

#[test]
fn a_blind_dock_stays_so_whatever_is_attached_to_it() {
    let blind = Change::Loss { links: Links::From(back_of(0)), probability: 1.0 };
    let mut robot = chain(&relay(), 2, 0);
    for change in [blind, Change::Detach(back_of(0)), Change::Attach(front_of(1), back_of(0))] {
        robot.change(&change).unwrap();
    }
    let mut engine = Engine::new(robot, 1);
    engine.run_until(130 * MILLISECOND);
    assert_eq!(hops(&engine.take_events(), 2), [vec![], vec![]]);
    let counts = engine.robot().link_counts(back_of(0)).unwrap();
    assert!(counts.frames > 0 && counts.lost_frames == counts.frames, "{counts:?}");
}

#[test]
fn what_a_link_loses_is_kept_also_where_it_is_attached_anew() {
    let at = |milliseconds, change| simulation::Event { at: milliseconds * MILLISECOND, change };
    let timeline = vec![
        at(90, Change::Loss { links: Links::From(back_of(0)), probability: 1.0 }),
        at(120, Change::Detach(back_of(0))),
        at(120, Change::Attach(back_of(0), front_of(1))),
    ];
    let mut run = Run::new(Engine::new(chain(&relay(), 2, 0), 1), timeline, 1000 * MILLISECOND);
    run.record(40 * MILLISECOND);
    while run.step(160 * MILLISECOND).unwrap() {}
    let lost = run.robot.robot().link_counts(back_of(0)).unwrap().lost_frames;
    let losses = run.finish_recording().unwrap().losses.unwrap();
    let losses: Vec<_> = losses.iter().map(|loss| (loss.look, loss.frames)).collect();
    assert_eq!(losses, [(3, 1), (4, lost)]);
}

#[test]
fn a_frame_lost_on_a_link_is_lost_to_all_behind_it() {
    let mut robot = chain(&relay(), 3, 0);
    let faults = Faults { lost_frames: [2, 3].into(), ..Faults::default() };
    assert!(robot.set_faults(back_of(0), faults.clone()));
    assert!(!robot.set_faults(back_of(2), faults), "nothing is attached there");
    let mut engine = Engine::new(robot, 1);
    engine.run_until(130 * MILLISECOND);
    assert_eq!(hops(&engine.take_events(), 3), [vec![], vec![1; 4], vec![2; 4]]);
    let counts = engine.robot().link_counts(back_of(0)).unwrap();
    assert_eq!((counts.frames, counts.lost_frames), (6, 2));
}

#[test]
fn what_is_detached_or_without_power_passes_nothing_on() {
    let mut engine = Engine::new(chain(&relay(), 4, 0), 1);
    let passed = |engine: &mut Engine, change: Option<Change>| {
        if let Some(change) = change {
            engine.robot_mut().change(&change).unwrap();
        }
        engine.run_until(engine.cycle() + 100 * MILLISECOND);
        hops(&engine.take_events(), 4).iter().map(Vec::len).collect::<Vec<usize>>()
    };
    assert_eq!(passed(&mut engine, None), [0, 4, 4, 4]);
    assert_eq!(passed(&mut engine, Some(Change::Detach(front_of(2)))), [0, 5, 0, 0]);
    // The third module takes the place of the second.
    assert_eq!(passed(&mut engine, Some(Change::Swap(1, 2))), [0, 0, 5, 0]);
    engine.robot_mut().change(&Change::Detach(back_of(1))).unwrap();
    assert_eq!(passed(&mut engine, Some(Change::Attach(back_of(2), front_of(3)))), [0, 0, 5, 5]);
    assert_eq!(passed(&mut engine, Some(Change::Kill(2))), [0, 0, 0, 0]);
    assert_eq!(engine.robot().crashes().count(), 0);
    assert_eq!(engine.robot().neighbour(back_of(0)), None);
}

#[test]
fn a_dock_before_an_obstacle_hears_itself() {
    let mut engine = Engine::new(chain(&relay(), 1, 0), 1);
    engine.run_until(30 * MILLISECOND);
    let heard = |engine: &Engine, module| {
        let mcu = engine.robot().module(module).unwrap().mcu(Controller::Slave);
        mcu.usart_counts(0).unwrap().unheard
    };
    // The slave's receiver is off, so echoes count as unheard.
    assert_eq!(heard(&engine, 0), 0);
    engine.robot_mut().change(&Change::Obstacle { at: back_of(0), is_there: true }).unwrap();
    engine.run_until(110 * MILLISECOND);
    assert_eq!(heard(&engine, 0), 4 * 3);
    engine.robot_mut().change(&Change::Obstacle { at: back_of(0), is_there: false }).unwrap();
    engine.run_until(200 * MILLISECOND);
    assert_eq!(heard(&engine, 0), 4 * 3);
}

#[test]
fn an_obstacle_stays_where_it_is_when_modules_change_places() {
    let mut engine = Engine::new(chain(&relay(), 2, 0), 1);
    for change in [Change::Obstacle { at: back_of(1), is_there: true }, Change::Swap(0, 1)] {
        engine.robot_mut().change(&change).unwrap();
    }
    engine.run_until(110 * MILLISECOND);
    let mcu = engine.robot().module(0).unwrap().mcu(Controller::Slave);
    assert!(mcu.usart_counts(0).unwrap().unheard > 0);
    let obstacle = WiringError::Obstacle { module: 0, dock: Dock::Back };
    assert_eq!(engine.robot_mut().attach(front_of(1), back_of(0)), Err(obstacle));
}

#[test]
fn modules_get_their_power_at_different_times() {
    let robot = |seed| {
        let builder = RobotBuilder::chain(relay(), 20).power_up_within(20 * MILLISECOND);
        builder.seed(seed).build().unwrap()
    };
    let times = |robot: &Robot| -> Vec<u64> {
        (0..20).map(|module| robot.module(module).unwrap().powered_up_at()).collect()
    };
    let robots = [robot(1), robot(2)];
    assert_ne!(times(&robots[0]), times(&robots[1]));
    assert!(times(&robots[0]).iter().all(|&at| at < 20 * MILLISECOND));
    let mut engine = Engine::new(robot(1), 2);
    engine.run_until(10 * MILLISECOND);
    let early = |module: usize| times(&robots[0])[module] < 10 * MILLISECOND;
    for module in 0..20 {
        let awake = engine.robot().module(module).unwrap().mcu(Controller::Master).awake_cycles();
        assert_eq!(awake > 0, early(module), "module {module}");
    }
}

/// Memories at power-up and losses on a link depend on the seed. Threads, steps and quantum change nothing.
#[test]
fn the_outcome_depends_on_the_seed_only() {
    let images = relay();
    let outcome = |seed: u64, threads: usize, step: u64, quantum: u64| {
        let mut robot = chain(&images, 5, seed);
        robot.set_faults(back_of(1), Faults { byte_loss: 0.1, frame_loss: 0.2, ..Faults::default() });
        for module in 0..5 {
            robot.module_mut(module).unwrap().set_quantum(quantum);
        }
        let mut engine = Engine::new(robot, threads);
        while engine.cycle() < 150 * MILLISECOND {
            engine.run_until((engine.cycle() + step).min(150 * MILLISECOND));
        }
        let links = engine.robot().link_counts(back_of(1)).unwrap();
        (engine.robot().state_hash(), links, engine.take_events())
    };
    let expected = outcome(1, 1, u64::MAX / 2, u64::MAX);
    assert!(expected.1.lost_bytes > 0 && expected.1.lost_bytes < expected.1.bytes);
    for threads in [2, 3, 5, 64] {
        assert_eq!(outcome(1, threads, u64::MAX / 2, u64::MAX), expected, "{threads} threads");
    }
    for quantum in [40, 333] {
        assert_eq!(outcome(1, 2, u64::MAX / 2, quantum), expected, "quantum {quantum}");
    }
    for step in [1000, 5 * MILLISECOND + 7] {
        let mut found = outcome(1, 2, step, u64::MAX);
        // Only the markers of one call are in order.
        found.2.sort();
        assert_eq!(found, expected, "step {step}");
    }
    assert_ne!(outcome(2, 1, u64::MAX / 2, u64::MAX).0, expected.0);
}

/// At 500 kBd a frame takes 320 cycles, and the windows are as short.
#[test]
fn fast_links_deliver_in_time() {
    let images = relay_at(3);
    let outcome = |threads, step| {
        let mut engine = Engine::new(chain(&images, 3, 0), threads);
        while engine.cycle() < 50 * MILLISECOND {
            engine.run_until(engine.cycle() + step);
        }
        (engine.robot().state_hash(), engine.take_events())
    };
    let whole = outcome(1, 50 * MILLISECOND);
    assert_eq!(hops(&whole.1, 3), [vec![], vec![1, 1], vec![2, 2]]);
    // With steps shorter than a frame, no window is longer than a step.
    assert_eq!(outcome(2, 100), whole);
}

#[test]
fn a_program_that_crashes_is_named() {
    let images = Images { master: build_with("program.c", &["CRASH"]), slave: build_with("program.c", &[]) };
    let mut engine = Engine::new(RobotBuilder::chain(images, 2).build().unwrap(), 2);
    engine.run_until(MILLISECOND);
    let crashes: Vec<_> = engine.robot().crashes().collect();
    let places: Vec<_> = crashes.iter().map(|(module, mcu, _)| (*module, *mcu)).collect();
    assert_eq!(places, [(0, Controller::Master), (1, Controller::Master)]);
    assert!(crashes[0].2.contains("Invalid Opcode"), "{}", crashes[0].2);
}
