//! No interrupt and no task ever masks interrupts for longer than its bound, and no job of a task takes
//! longer than its bound.

use std::collections::BTreeMap;

use simavr_harness::{CLOCK_HZ, Controller, Engine, Face, Images, MaskedWindow, OpenedBy, RobotBuilder};
use superbot_tests_simavr::bounds::{Noted, pull};
use superbot_tests_simavr::{firmware, image};
use tasks::dock::Dock;
use time_bound::{Bounds, Job};

const SECOND: u64 = CLOCK_HZ as u64;

/// The module under test.
pub(super) const FLOODED: usize = 0;

/// The task whose last loop is a period of the joints' control.
const JOINTS: &str = "tasks::motor::task";

/// How long a pull at the joints lasts in one direction, in cycles, and how many pulls there are.
const TURN: u64 = SECOND / 20;
const TURNS: u64 = 16;

/// A module with neighbours at all docks that send as fast as they can; one of them asks its console.
pub(super) fn flooded() -> Engine {
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

/// The bounds computed from an image of the robot.
struct Computed {
    bounds: Bounds,
    /// The address of the kernel's switch to another task.
    switch: u32,
}

fn computed(name: &str) -> Computed {
    let noted = Noted::load(name);
    let switch = noted.image.function("kernel_switch").expect("each image has the kernel");
    Computed { bounds: noted.bounds(), switch }
}

impl Computed {
    /// The jobs of each task, or of tasks with the same code, by the module of its source.
    fn tasks(&self) -> BTreeMap<&str, Vec<&Job>> {
        let mut tasks = BTreeMap::<_, Vec<_>>::new();
        for job in &self.bounds.jobs {
            tasks.entry(module(&job.function)).or_default().push(job);
        }
        tasks
    }
}

/// The module that a function is in: `tasks::link::send` of `<tasks::link::send::Line<...>>::transmit`.
fn module(function: &str) -> &str {
    let path = function.trim_start_matches('<');
    let path = path.split(['<', '>', ' ']).next().unwrap_or(path).trim_end_matches(':');
    path.rsplit_once("::").map_or(path, |(module, _)| module)
}

/// In place of a vector's number: an instruction masks interrupts, in a task or in an interrupt that masks
/// others again.
const BY_INSTRUCTION: u8 = 0;

/// The longest window for each cause that opens one.
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

/// After a `reti` to the program an instruction of it would run though an interrupt is pending, and a whole
/// critical section if that were a `cli`.
#[test]
fn no_handler_returns_by_reti_to_the_program() {
    for name in ["firmware-master", "firmware-slave"] {
        for interrupt in computed(name).bounds.interrupts {
            assert_eq!(interrupt.masked_last, 0, "{name}: {}", interrupt.name);
        }
    }
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
        for jobs in computed.tasks().values() {
            mcu.record_jobs(jobs.iter().map(|job| job.address), computed.switch);
        }
    }
    for turn in 1..=TURNS {
        pull(&mut engine, FLOODED, turn % 2 == 0);
        engine.run_until(SECOND / 2 + turn * TURN);
    }

    println!("MCU     masked by, or job            bound  longest  bound over longest");
    let mut beyond = Vec::new();
    let mut hold = |controller, what: String, bound: u64, longest: u64| {
        let over = bound as f64 / longest as f64;
        println!("{:7} {what:28} {bound:6} {longest:8} {over:19.2}", format!("{controller:?}"));
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
        let recorded = mcu.recorded_jobs();
        let tasks = computed.tasks();
        let period = tasks[JOINTS].last().expect("the joints' control is noted");
        let periods = recorded[&period.address].times;
        assert!(periods > 100, "the joints were controlled in {periods} periods only");
        for (task, jobs) in tasks {
            let times: u64 = jobs.iter().map(|job| recorded[&job.address].times).sum();
            assert!(times > 10, "{task} had {times} jobs only");
            for (number, job) in jobs.iter().enumerate() {
                hold(*controller, format!("{task} {number}"), job.cycles, recorded[&job.address].cycles);
            }
        }
    }
    assert!(beyond.is_empty(), "longer than the bound: {beyond:?}");
}
