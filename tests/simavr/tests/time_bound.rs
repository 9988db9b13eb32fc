//! No interrupt and no task ever masks interrupts for longer than was computed, and no period of the joints'
//! control computes for longer.

use std::collections::BTreeMap;

use simavr_harness::{CLOCK_HZ, Controller, Engine, Face, Images, MaskedWindow, OpenedBy, RobotBuilder};
use superbot_tests_simavr::bounds::{Noted, pull};
use superbot_tests_simavr::{firmware, image};
use tasks::dock::Dock;
use time_bound::{Bounds, Job};

const SECOND: u64 = CLOCK_HZ as u64;

/// The module that is looked at.
const FLOODED: usize = 0;

/// For how long something pulls at the joints one way, in cycles, and how often.
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

/// What was computed of an image of the robot.
struct Computed {
    bounds: Bounds,
    /// Where the kernel switches to another task.
    switch: u32,
}

fn computed(name: &str) -> Computed {
    let noted = Noted::load(name);
    let switch = noted.image.function("kernel_switch").expect("each image has the kernel");
    Computed { bounds: noted.bounds(), switch }
}

impl Computed {
    /// A period of the joints' control: the last of its task's loops.
    fn period(&self) -> &Job {
        let jobs = self.bounds.jobs.iter().filter(|job| job.function.starts_with("tasks::motor::task::run"));
        jobs.last().expect("the joints' control is noted")
    }
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
    let mcus = [(Controller::Master, "firmware-master"), (Controller::Slave, "firmware-slave")];
    let mcus = mcus.map(|(controller, name)| (controller, computed(name)));
    let mut engine = flooded();
    engine.run_until(SECOND / 2);
    for (controller, computed) in &mcus {
        let module = engine.robot_mut().module_mut(FLOODED).expect("it is there");
        let mcu = module.mcu_mut(*controller);
        mcu.record_masked_windows();
        mcu.record_turns(computed.period().address, computed.switch);
    }
    for turn in 1..=TURNS {
        pull(&mut engine, FLOODED, turn % 2 == 0);
        engine.run_until(SECOND / 2 + turn * TURN);
    }

    println!("MCU     masked by  bound  longest  bound over longest");
    let mut beyond = Vec::new();
    let mut hold = |controller, what: String, bound: u64, longest: u64| {
        let over = bound as f64 / longest as f64;
        println!("{:7} {what:>9} {bound:6} {longest:8} {over:19.2}", format!("{controller:?}"));
        if longest > bound {
            beyond.push((controller, what, longest, bound));
        }
    };
    for (controller, computed) in &mcus {
        let bounds = &computed.bounds;
        let mcu = engine.robot().module(FLOODED).expect("it is there").mcu(*controller);
        for (by, cycles) in longest(&mcu.recorded_windows(), bounds) {
            let interrupt = bounds.interrupts.iter().find(|interrupt| interrupt.vector == by);
            let bound = interrupt.map_or(bounds.masked_by_instructions(), |interrupt| interrupt.masked);
            hold(*controller, by.to_string(), bound, cycles);
        }
        let (cycles, times) = mcu.recorded_turns();
        assert!(times > 100, "the joints were controlled in {times} periods only");
        hold(*controller, "(period)".to_owned(), computed.period().cycles, cycles);
    }
    assert!(beyond.is_empty(), "longer than the bound: {beyond:?}");
}
