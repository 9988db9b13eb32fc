//! No interrupt and no task ever masks interrupts for longer than was computed.

use std::collections::BTreeMap;
use std::path::Path;

use simavr_harness::{CLOCK_HZ, Controller, Engine, Face, Images, MaskedWindow, OpenedBy, RobotBuilder};
use stack_bound::{Annotations, Image};
use superbot_tests_simavr::{firmware, image, images};
use tasks::dock::Dock;
use tasks::motor::Axis;
use time_bound::{Bounds, Notes};

const SECOND: u64 = CLOCK_HZ as u64;

/// The module that is looked at.
const FLOODED: usize = 0;

/// What pulls at the joints, in Nm, to and fro, and for how long each, in cycles: so that they are controlled.
const PULL: f64 = 3.0;
const TURN: u64 = SECOND / 20;
const TURNS: u64 = 16;

/// A module whose neighbours at all docks send as fast as they can, one of which asks its console.
fn flooded() -> Engine {
    let neighbour = |master, slave| Images { master: image(master), slave: image(slave) };
    let neighbours = [
        (Dock::Front, Dock::Back, neighbour("flood_side", "flood_back")),
        (Dock::Back, Dock::Front, neighbour("flood_front", "flood_side")),
        (Dock::Left, Dock::Back, neighbour("flood_side", "flood_side")),
        (Dock::Right, Dock::Back, neighbour("flood_side", "flood_side")),
        (Dock::Up, Dock::Back, neighbour("flood_console", "flood_console")),
        (Dock::Down, Dock::Back, neighbour("flood_side", "flood_side")),
    ];
    let mut robot = RobotBuilder::new(firmware(), 1 + neighbours.len()).seed(1);
    for (module, (dock, theirs, images)) in (1..).zip(neighbours) {
        let [here, there] = [(FLOODED, dock), (module, theirs)].map(|(module, dock)| Face { module, dock });
        robot = robot.program(module, images).attach(here, there);
    }
    Engine::new(robot.build().expect("the robot can be built"), 2)
}

/// The bounds of an image of the robot.
fn bounds(name: &str) -> Bounds {
    let notes = |file: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name).join(file);
    let image = Image::load(images().join(name).with_extension("elf")).expect("the image can be read");
    let annotations = Annotations::load(notes("stacks.txt"), &image).expect("the notes fit");
    let loops = Notes::load(notes("loops.txt"), &image).expect("the notes fit");
    Bounds::new(&image, &annotations, &loops).unwrap_or_else(|problems| panic!("{name}: {problems:?}"))
}

/// In place of a vector's number: in a task, or in an interrupt that masks others again.
const BY_INSTRUCTION: u8 = 0;

/// The longest windows by what opened them.
fn longest(windows: &[MaskedWindow], bounds: &Bounds) -> BTreeMap<u8, u64> {
    let mut longest = BTreeMap::new();
    for window in windows {
        let by = match window.opened_by {
            OpenedBy::Start => continue,
            OpenedBy::Interrupt(vector) => vector,
            OpenedBy::Instruction => BY_INSTRUCTION,
        };
        let known = longest.entry(by).or_insert(0);
        *known = window.cycles.max(*known);
    }
    assert!(longest.len() > bounds.interrupts.len() / 2, "few interrupts came: {longest:?}");
    longest
}

#[test]
fn of_the_robot() {
    let mut engine = flooded();
    let pull = |engine: &mut Engine, pull: f64| {
        let module = engine.robot_mut().module_mut(FLOODED).expect("it is there");
        for axis in Axis::ALL {
            module.body_mut().joint_mut(axis).surroundings.load_torque = pull;
        }
    };
    engine.run_until(SECOND / 2);
    for controller in Controller::ALL {
        let module = engine.robot_mut().module_mut(FLOODED).expect("it is there");
        module.mcu_mut(controller).record_masked_windows();
    }
    for turn in 1..=TURNS {
        pull(&mut engine, if turn % 2 == 0 { -PULL } else { PULL });
        engine.run_until(SECOND / 2 + turn * TURN);
    }

    println!("MCU     vector   bound  longest  bound over longest");
    let mut beyond = Vec::new();
    for (controller, name) in [(Controller::Master, "firmware-master"), (Controller::Slave, "firmware-slave")]
    {
        let bounds = bounds(name);
        let module = engine.robot().module(FLOODED).expect("it is there");
        let windows = module.mcu(controller).recorded_windows();
        for (by, cycles) in longest(&windows, &bounds) {
            let interrupt = bounds.interrupts.iter().find(|interrupt| interrupt.vector == by);
            let bound = interrupt.map_or(bounds.masked_by_instructions(), |interrupt| interrupt.masked);
            let over = bound as f64 / cycles as f64;
            println!("{:7} {by:6} {bound:7} {cycles:8} {over:19.2}", format!("{controller:?}"));
            if cycles > bound {
                beyond.push((controller, by, cycles, bound));
            }
        }
    }
    assert!(beyond.is_empty(), "masked for longer than the bound: {beyond:?}");
}
