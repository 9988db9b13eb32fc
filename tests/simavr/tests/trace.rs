//! The timeline of an MCU's tasks: their times are those that the CPU has spent, and their waits are those of
//! the program.

use simavr_harness::{Holder, Mcu, State, TaskState, Trace};
use superbot_tests_simavr::mcu;

/// The marks of the image `cpu_time`.
const BEGUN: u8 = 1;
const DONE: u8 = 2;

/// The most cycles of a switch from charging the time to the turn to another task. With interrupts in between
/// it may be more, but rarely.
const SWITCH: u64 = 64;

/// The most cycles from the last times that the report reads to its mark.
const REPORT: u64 = 200;

fn traced(image: &str) -> Mcu {
    let mut mcu = mcu(image);
    mcu.trace().expect("the image has the kernel");
    mcu
}

/// How long the task of this name had the CPU, and how often it got it.
fn running(trace: &Trace, task: &str) -> (u64, u64) {
    let task = trace.tasks.iter().find(|traced| &*traced.name == task).expect("there is such a task");
    let slices = task.states.iter().filter(|slice| slice.what == TaskState::Running);
    slices.fold((0, 0), |(cycles, turns), slice| (cycles + slice.cycles(), turns + 1))
}

/// Asserts that all slices lie in the run, one after the other, and that those that took the CPU add up to
/// the time that it was awake.
fn assert_adds_up(trace: &Trace, awake: u64, end: u64) {
    assert!(trace.cpu.windows(2).all(|pair| pair[0].end == pair[1].begin));
    assert_eq!(trace.cpu.last().map(|slice| slice.end), Some(end));
    let is_awake = |holder| !matches!(holder, Holder::Sleep | Holder::Reset);
    let cycles: u64 = trace.cpu.iter().filter(|slice| is_awake(slice.what)).map(|slice| slice.cycles()).sum();
    assert_eq!(cycles, awake);
    for (index, task) in trace.tasks.iter().enumerate() {
        assert!(task.states.windows(2).all(|pair| pair[0].end <= pair[1].begin), "{}", task.name);
        assert!(task.states.iter().all(|slice| slice.begin < slice.end && slice.end <= end));
        let held = trace.cpu.iter().filter(|slice| slice.what == Holder::Task(index));
        let held: u64 = held.map(|slice| slice.cycles()).sum();
        assert_eq!(running(trace, &task.name).0, held, "{}", task.name);
    }
    let mut under_way: Vec<u64> = Vec::new();
    for interrupt in &trace.interrupts {
        under_way.retain(|&end| end > interrupt.begin);
        assert!(under_way.iter().all(|&outer| interrupt.end <= outer), "{interrupt:?} goes on for too long");
        under_way.push(interrupt.end);
        let holder = trace.cpu.iter().rfind(|slice| slice.begin <= interrupt.begin);
        let holder = holder.expect("somebody has the CPU");
        assert!(interrupt.end <= holder.end && holder.what != Holder::Sleep, "{interrupt:?} in {holder:?}");
    }
}

#[test]
fn tasks_run_for_as_long_as_the_kernel_counts() {
    let mut mcu = traced("cpu-time/cpu_time");
    let begun = mcu.run_to_marker(BEGUN, 1_000_000).expect("the clock starts").cycle;
    mcu.run_to_marker(DONE, 20_000_000).expect("it reports");
    let report = mcu.read_symbol("REPORT").expect("the image reports");
    let (awake, end) = (mcu.awake_cycles(), mcu.cycle());
    let trace = mcu.take_trace().expect("it was traced");
    assert_adds_up(&trace, awake, end);

    let reported: Vec<u64> = report
        .chunks(4)
        .map(|bytes| u32::from_le_bytes(bytes.try_into().expect("a time has 4 bytes")).into())
        .collect();
    // In the order of the report. The second worker's stack follows the first one's.
    let other = trace.tasks.iter().find(|task| task.name.starts_with("WORKERS+")).expect("it has run");
    let names = ["CONTROL", "WORKERS", &other.name, "REPORTER"];
    for (name, time) in names.into_iter().zip([reported[0], reported[1], reported[2], reported[4]]) {
        let (cycles, turns) = running(&trace, name);
        let (off, most) = (time.abs_diff(cycles), SWITCH * turns + REPORT);
        println!("{name:12} {time:9} reported {cycles:9} traced, {off} apart in {turns} turns");
        assert!(time > 0 && off <= most, "{name}: {off} cycles apart, {most} at most");
    }
    let is_idle = |holder| matches!(holder, Holder::Idle | Holder::Sleep | Holder::Start);
    let idle = trace.cpu.iter().filter(|slice| slice.begin >= begun || slice.end > begun);
    let idle: Vec<_> = idle.filter(|slice| is_idle(slice.what)).collect();
    let cycles: u64 = idle.iter().map(|slice| slice.end - slice.begin.max(begun)).sum();
    let most = SWITCH * idle.len() as u64 + REPORT;
    assert!(reported[3].abs_diff(cycles) <= most, "idle: {} reported, {cycles} traced", reported[3]);
}

#[test]
fn each_wait_tells_what_it_is_for() {
    let mut mcu = traced("waits");
    assert_eq!(mcu.run_to_end(1_000_000), State::Done);
    let (awake, end) = (mcu.awake_cycles(), mcu.cycle());
    let trace = mcu.take_trace().expect("it was traced");
    assert_adds_up(&trace, awake, end);
    let waits = |task: &str| {
        let task = trace.tasks.iter().find(|traced| &*traced.name == task).expect("there is such a task");
        let told = task.states.iter().filter_map(|slice| match &slice.what {
            TaskState::Running | TaskState::Ready => None,
            TaskState::Waiting(wait) => {
                // The compiler chooses where in a queue its semaphore lies.
                let names = wait.on.iter().map(|name| name.split('+').next().unwrap_or(name));
                Some((names.collect::<Vec<_>>().join(" "), wait.ticks))
            }
            other => Some((format!("{other:?}"), None)),
        });
        told.collect::<Vec<_>>()
    };
    let wait = |on: &str, ticks| (on.to_owned(), ticks);
    assert_eq!(
        waits("FIRST"),
        [
            wait("SIGNAL", None),
            wait("SIGNAL OTHER", None),
            wait("SIGNAL", Some(5)),
            wait("READINGS", None),
            wait("", Some(3))
        ]
    );
    assert_eq!(waits("SECOND"), [wait("SIGNAL", None), wait("Suspended", None), wait("NEVER", None)]);
    assert_eq!(waits("LAST"), [wait("", Some(10))]);
}

#[test]
fn a_reset_ends_what_was_under_way() {
    let mut mcu = traced("waits");
    mcu.set_start_up(5_000);
    mcu.run_until(60_000);
    let first = mcu.cycle();
    mcu.reset(simavr_harness::Reset::External);
    mcu.run_until(62_000); // within the start
    mcu.reset(simavr_harness::Reset::External);
    let second = mcu.cycle();
    assert_eq!(mcu.run_to_end(1_000_000), State::Done);
    let (awake, end) = (mcu.awake_cycles(), mcu.cycle());
    let trace = mcu.take_trace().expect("it was traced");
    assert_adds_up(&trace, awake, end);
    let resets: Vec<_> = trace.cpu.iter().filter(|slice| slice.what == Holder::Reset).collect();
    assert_eq!(
        resets.iter().map(|slice| (slice.begin, slice.end)).collect::<Vec<_>>(),
        [(first, second + 5_000)]
    );
    for task in &trace.tasks {
        let in_reset = |begin, end| begin < second + 5_000 && end > first;
        assert!(task.states.iter().all(|slice| !in_reset(slice.begin, slice.end)), "{}", task.name);
        assert!(task.states.iter().any(|slice| slice.begin > second), "{} began again", task.name);
    }
    assert_eq!(trace.tasks.len(), 3);
}
