//! The console's text at a dock, compared with observations from outside.

use std::collections::BTreeMap;
use std::num::NonZeroU32;
use std::ops::RangeInclusive;

use simavr_harness::{Controller, Engine, Face, Module, RobotBuilder};
use simulation::{Change, Scenario, Transcript};
use superbot_tests_simavr::{MILLISECOND, firmware};
use tasks::dock::Dock;

const SECOND: u64 = 1000 * MILLISECOND;

/// The byte that fills the unused part of a stack, after its control block.
const PAINT: u8 = 0xa5;
const CONTROL_BLOCK: usize = 6;

/// The console's names of the tasks, the names of their stacks in the images, and their priorities.
const MASTER: [(&str, &str, u16); 11] = [
    ("joints", "MOTORS", 0),
    ("receive", "RECEIVE", 1),
    ("bridge", "BRIDGE", 1),
    ("send USART0", "SEND_USART0", 2),
    ("send USART1", "SEND_USART1", 2),
    ("send soft UART", "SEND_SOFT_UART", 2),
    ("devices", "DEVICES", 3),
    ("AC_RECV", "AC_RECEIVE", 4),
    ("AC_SEND", "AC_SEND", 5),
    ("HORMONE", "HORMONE", 6),
    ("inspector", "INSPECTOR", 7),
];
const SLAVE: [(&str, &str, u16); 9] = [
    ("joints", "MOTORS", 0),
    ("receive", "RECEIVE", 1),
    ("bridge", "BRIDGE", 1),
    ("send USART0", "SEND_USART0", 2),
    ("send USART1", "SEND_USART1", 2),
    ("send soft UART", "SEND_SOFT_UART", 2),
    ("devices", "DEVICES", 3),
    ("console", "CONSOLE", 6),
    ("inspector", "INSPECTOR", 7),
];

/// The fields of the counters, as docs/inside.md lists them.
const LINK: [&str; 12] = [
    "frames_sent",
    "frames_received",
    "retries",
    "errors",
    "duplicates",
    "gave_up",
    "reflections",
    "ignored",
    "refused",
    "no_buffer",
    "overruns",
    "replaced",
];
const BRIDGE: [&str; 8] =
    ["messages_sent", "messages_received", "retries", "errors", "gave_up", "ignored", "no_buffer", "freed"];
const JOINTS: [&str; 2] = ["periods", "missed"];
const DEVICES: [&str; 2] = ["unsent", "malformed"];

/// The symbols of the links, by dock.
const LINKS: [(Controller, &str); 6] = [
    (Controller::Master, "LINK_USART0"),
    (Controller::Slave, "LINK_USART0"),
    (Controller::Master, "LINK_USART1"),
    (Controller::Master, "LINK_SOFT_UART"),
    (Controller::Slave, "LINK_USART1"),
    (Controller::Slave, "LINK_SOFT_UART"),
];

/// The bytes of the variable whose name ends with `suffix`.
fn read(module: &Module, controller: Controller, suffix: &str) -> Vec<u8> {
    let mcu = module.mcu(controller);
    let name = mcu
        .image()
        .symbols()
        .map(|(name, _)| name)
        .find(|name| format!("{:#}", rustc_demangle::demangle(name)).ends_with(suffix))
        .unwrap_or_else(|| panic!("{controller:?} has no {suffix}"));
    mcu.read_symbol(name).expect("it lies in RAM")
}

fn counts(module: &Module, controller: Controller, symbol: &str, fields: usize) -> Vec<u16> {
    let bytes = module.mcu(controller).read_symbol(symbol).expect("the image has it");
    bytes.chunks(2).take(fields).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]])).collect()
}

/// The numbers that a console may report at a moment, by their row and column.
fn numbers(module: &Module) -> BTreeMap<(String, usize), u16> {
    let mut numbers = BTreeMap::new();
    for (controller, title, tasks) in
        [(Controller::Master, "master", &MASTER[..]), (Controller::Slave, "slave", &SLAVE)]
    {
        for &(task, stack, priority) in tasks {
            let bytes = read(module, controller, &format!("stack::{stack}"));
            let memory = &bytes[CONTROL_BLOCK..];
            let unused = memory.iter().take_while(|&&byte| byte == PAINT).count();
            let columns = [priority, memory.len() as u16, unused as u16];
            for (column, number) in columns.into_iter().enumerate() {
                numbers.insert((format!("{title} {task}"), column), number);
            }
        }
        let side = controller as usize;
        for (field, count) in BRIDGE.iter().zip(counts(module, controller, "BRIDGE", 8)) {
            numbers.insert((format!("bridge {field}"), side), count);
        }
        for (field, count) in JOINTS.iter().zip(counts(module, controller, "MOTORS", 2)) {
            numbers.insert((format!("joints' control {field}"), side), count);
        }
        for (field, count) in DEVICES.iter().zip(counts(module, controller, "DESK", 2)) {
            numbers.insert((format!("devices {field}"), side), count);
        }
    }
    for (column, (controller, symbol)) in LINKS.into_iter().enumerate() {
        for (field, count) in LINK.iter().zip(counts(module, controller, symbol, 12)) {
            numbers.insert((format!("links {field}"), column), count);
        }
    }
    numbers
}

/// The numbers in a text, by their row and column.
fn numbers_told(text: &str) -> BTreeMap<(String, usize), u16> {
    let mut numbers = BTreeMap::new();
    for table in text.split("\n\n").skip(1) {
        let mut lines = table.lines();
        let title = lines.next().expect("a table has a head").split("  ").next().expect("a title");
        for line in lines {
            let words: Vec<&str> = line.split_whitespace().collect();
            let values = words.iter().rev().map_while(|word| word.parse::<u16>().ok()).count();
            let (name, values) = words.split_at(words.len() - values);
            for (column, value) in values.iter().enumerate() {
                let number = value.parse().expect("it was parsed before");
                numbers.insert((format!("{title} {}", name.join(" ")), column), number);
            }
        }
    }
    numbers
}

/// The percentage of time that an MCU is awake according to a text, and the rest of the line.
fn awake<'a>(text: &'a str, mcu: &str) -> (f64, &'a str) {
    let line = text.lines().find_map(|line| line.strip_prefix(&format!("{mcu}: awake for ")));
    let (awake, rest) = line.and_then(|line| line.split_once(" % of 50 ms, ")).expect("the line is there");
    (awake.parse().expect("a number"), rest)
}

/// Runs until the console's text is complete, and returns it.
///
/// # Panics
/// When that takes more than 10 s.
fn listen(engine: &mut Engine) -> Transcript {
    let end = engine.cycle() + 10 * SECOND;
    loop {
        engine.run_until(engine.cycle() + 10 * MILLISECOND);
        let last = engine.robot().transcripts().pop().expect("a terminal asks");
        if last.is_complete {
            return last;
        }
        assert!(engine.cycle() < end, "no more than this in 10 s: {}", last.text);
    }
}

fn lone_module() -> Engine {
    let mut engine =
        Engine::new(RobotBuilder::new(firmware(), 1).seed(1).build().expect("it can be built"), 1);
    engine.run_until(SECOND);
    engine
}

fn ask(engine: &mut Engine, module: usize, dock: Dock) {
    engine.robot_mut().change(&Change::Console(Face { module, dock })).expect("the dock is free");
}

/// robots/console.toml: each number that the spine reports lies between its values in RAM before and after.
#[test]
fn a_spine_tells_what_is_so() {
    let Scenario { wiring, timeline, .. } =
        Scenario::from_toml(include_str!("../../../robots/console.toml")).expect("the file is right");
    let robot = RobotBuilder::wired(firmware(), &wiring).seed(1).build().expect("it can be built");
    let mut engine = Engine::new(robot, 1);
    let [event] = &timeline[..] else { panic!("one event") };
    let Change::Console(Face { module, .. }) = event.change else { panic!("it asks the console") };
    engine.run_until(event.at);
    engine.robot_mut().change(&event.change).expect("the dock is free");
    let spine = |engine: &Engine| numbers(engine.robot().module(module).expect("it is there"));
    let before = spine(&engine);
    let text = listen(&mut engine).text;
    let after = spine(&engine);
    let told = numbers_told(&text);
    assert_eq!(told.keys().collect::<Vec<_>>(), before.keys().collect::<Vec<_>>(), "{text}");
    for (place, &number) in &told {
        let (before, after) = (before[place], after[place]);
        let range: RangeInclusive<u16> = before.min(after)..=before.max(after);
        assert!(range.contains(&number), "{place:?}: {number} is not in {range:?}\n{text}");
    }
    assert!(text.starts_with(concat!("SuperBot ", env!("CARGO_PKG_VERSION"), "\n")), "{text}");
    for mcu in ["master", "slave"] {
        assert_eq!(awake(&text, mcu).1, "reset by power-on", "{text}");
    }
}

/// The most that interrupts take of an idle MCU's time, in percent. It counts as idle, because an interrupt's
/// time belongs to what it preempts. The slave has the most: each millisecond's tick wakes it for the joints.
const INTERRUPTS_OF_IDLENESS: f64 = 1.5;

/// A lone module does the same all the time, so the load that its inspectors measure in 50 ms also holds for
/// a second.
#[test]
fn the_load_is_what_it_is_without_a_console() {
    let mut engine = lone_module();
    let awake_cycles = |engine: &Engine| {
        let module = engine.robot().module(0).expect("it is there");
        Controller::ALL.map(|mcu| module.mcu(mcu).awake_cycles())
    };
    let before = awake_cycles(&engine);
    engine.run_until(2 * SECOND);
    let after = awake_cycles(&engine);
    ask(&mut engine, 0, Dock::Up);
    let text = listen(&mut engine).text;
    for (mcu, name) in Controller::ALL.into_iter().zip(["master", "slave"]) {
        let percent = (after[mcu as usize] - before[mcu as usize]) as f64 * 100.0 / SECOND as f64;
        let told = awake(&text, name).0;
        let untold = percent - told;
        assert!(
            (-0.5..=INTERRUPTS_OF_IDLENESS).contains(&untold),
            "{name}: {told} % told, {percent:.2} % awake"
        );
    }
}

#[test]
fn every_dock_tells_the_same() {
    for dock in Dock::ALL {
        let mut engine = lone_module();
        ask(&mut engine, 0, dock);
        let text = listen(&mut engine).text;
        let seconds = (engine.cycle() - SECOND) as f64 / SECOND as f64;
        assert!(seconds <= 4.0, "{dock:?}: {seconds} s");
        let module = engine.robot().module(0).expect("it is there");
        let (told, is) = (numbers_told(&text), numbers(module));
        assert_eq!(told.keys().collect::<Vec<_>>(), is.keys().collect::<Vec<_>>(), "{dock:?}: {text}");
    }
}

/// Stops of a run, as for a page or a recording, change nothing. The console is asked at the same time in all
/// runs, even before the module has power.
#[test]
fn a_run_with_stops_is_the_same_run() {
    for (asked_at, within) in [(0, 0), (0, 40 * MILLISECOND), (300 * MILLISECOND, 0)] {
        let end = |stops: u64| {
            let robot = RobotBuilder::chain(firmware(), 2).seed(1).power_up_within(within);
            let mut engine = Engine::new(robot.build().expect("it can be built"), 1);
            engine.run_until(asked_at);
            ask(&mut engine, 0, Dock::Front);
            while engine.cycle() < SECOND {
                engine.run_until((engine.cycle() + stops).min(SECOND));
            }
            (engine.robot().transcripts(), engine.robot().state_hash())
        };
        let (transcripts, hash) = end(SECOND);
        assert!(transcripts[0].at == asked_at && transcripts[0].text.len() > 100, "{transcripts:?}");
        for stops in [7_001, 40 * MILLISECOND, 1_000_003] {
            assert_eq!(end(stops), (transcripts.clone(), hash), "stops each {stops} cycles");
        }
    }
}

#[test]
fn a_master_that_does_not_answer_is_told_of() {
    let mut engine = lone_module();
    engine.robot_mut().module_mut(0).expect("it is there").hold_data_wire(NonZeroU32::MAX);
    ask(&mut engine, 0, Dock::Up);
    let text = listen(&mut engine).text;
    assert!(text.contains("\nno answer from the master\nslave: awake for "), "{text}");
    assert!(!text.contains("HORMONE") && text.contains("\nconsole                6 "), "{text}");
}

/// A module is attached in place of a terminal, in the middle of a text. It does not take the text for a
/// request.
#[test]
fn a_neighbour_in_place_of_a_terminal_takes_no_harm() {
    let robot = RobotBuilder::new(firmware(), 2).seed(1).build().expect("it can be built");
    let mut engine = Engine::new(robot, 1);
    engine.run_until(SECOND);
    let (front, back) = (Face { module: 0, dock: Dock::Front }, Face { module: 1, dock: Dock::Back });
    ask(&mut engine, 0, Dock::Front);
    engine.run_until(engine.cycle() + 500 * MILLISECOND);
    engine.robot_mut().attach(front, back).expect("both are free");
    engine.run_until(engine.cycle() + SECOND);
    let transcript = engine.robot().transcripts().pop().expect("a terminal asked");
    assert!(!transcript.is_complete && !transcript.text.is_empty(), "{transcript:?}");
    let [taken, malformed] =
        counts(engine.robot().module(1).expect("it is there"), Controller::Slave, "CONSOLE", 2)[..]
    else {
        panic!("two counts")
    };
    assert!(taken == 0 && malformed <= 1, "{taken} {malformed}");
    assert!((0..2).all(|module| simulation::Robot::is_right(&engine, module)));
}
