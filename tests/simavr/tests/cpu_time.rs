//! The kernel's times of tasks are the cycles that the CPU has spent on them.

use simavr_harness::{Mcu, Place};
use superbot_tests_simavr::mcu;

/// The marks of the image.
const BEGUN: u8 = 1;
const DONE: u8 = 2;

/// The ends of the mangled names of statics.
const KERNEL: &str = "6kernel6KERNEL";
const IDLE: &str = "6kernel4IDLE";

/// The offset of the running task in `Kernel`.
const RUNNING: u16 = 2;

/// The image's stacks except idle's, in the order of its report: the name, the index in an array, and the
/// array's length.
const STACKS: [(&str, u16, u16); 4] =
    [("CONTROL", 0, 1), ("WORKERS", 0, 2), ("WORKERS", 1, 2), ("REPORTER", 0, 1)];

/// The most cycles of a switch from charging the time to changing the running task. With interrupts in
/// between it may be more, but rarely.
const SWITCH: u64 = 64;

/// The most cycles from the last times that the report reads to its mark.
const REPORT: u64 = 200;

#[test]
fn times_are_those_that_tasks_had() {
    let mut mcu = mcu("cpu-time/cpu_time");
    let running = data(&mcu, KERNEL).0 + RUNNING;
    let tasks = STACKS.map(|(name, number, count)| {
        let (start, size) = data(&mcu, name);
        start + number * (size / count)
    });
    let idle = data(&mcu, IDLE).0;
    let blocks = [tasks[0], tasks[1], tasks[2], idle, tasks[3]];

    let begun = mcu.run_to_marker(BEGUN, 1_000_000).expect("the clock starts").cycle;
    // The cycles during which each was the running task, and how often it became the running task.
    let mut cycles = [0; 5];
    let mut switches = [0; 5];
    let mut before = (mcu.cycle(), 3);
    while mcu.markers().last().map(|mark| mark.value) != Some(DONE) {
        let [low, high] = [running, running + 1].map(|address| mcu.read(address).expect("there is RAM"));
        // Between the stores of its two bytes the pointer is no task's.
        let task =
            blocks.iter().position(|&block| block == u16::from_le_bytes([low, high])).unwrap_or(before.1);
        mcu.step();
        assert!(mcu.is_alive());
        cycles[task] += mcu.cycle() - before.0;
        switches[task] += u64::from(task != before.1);
        before = (mcu.cycle(), task);
    }

    let report = mcu.read_symbol("REPORT").expect("the image reports");
    let reported: Vec<u64> = report
        .chunks(4)
        .map(|bytes| u32::from_le_bytes(bytes.try_into().expect("a time has 4 bytes")).into())
        .collect();
    let [times @ .., total] = &reported[..] else { panic!("nothing is reported") };
    for (name, ((time, cycles), switches)) in
        ["CONTROL", "one", "other", "idle", "REPORTER"].iter().zip(times.iter().zip(cycles).zip(switches))
    {
        let (off, most) = (time.abs_diff(cycles), SWITCH * switches + REPORT);
        println!("{name:8} {time:9} reported {cycles:9} counted, {off} apart in {switches} turns");
        assert!(*time > 0 && off <= most, "{name}: {off} cycles apart, {most} at most");
    }
    let passed = mcu.cycle() - begun;
    assert!(total.abs_diff(times.iter().sum()) < REPORT, "{total} in all, all together less");
    assert!(total.abs_diff(passed) < REPORT, "{total} in all, {passed} passed");
}

/// The address and the size of the static whose mangled name ends with `name`.
fn data(mcu: &Mcu, name: &str) -> (u16, u16) {
    let mut all = mcu.image().symbols().filter(|(mangled, _)| mangled.ends_with(name));
    match all.next().map(|(_, symbol)| (symbol.place, symbol.size)) {
        Some((Place::Data(start), size)) => (start, size),
        _ => panic!("the image has no {name}"),
    }
}
