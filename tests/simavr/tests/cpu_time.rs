//! What the kernel says of its tasks' times is what the CPU has done.

use simavr_harness::{Mcu, Place};
use superbot_tests_simavr::mcu;

/// The marks of the image.
const BEGUN: u8 = 1;
const DONE: u8 = 2;

/// How the mangled names of statics end.
const KERNEL: &str = "6kernel6KERNEL";
const IDLE: &str = "6kernel4IDLE";

/// Where in `Kernel` the running task stands.
const RUNNING: u16 = 2;

/// The image's stacks but for idle, in the order of its report; of an array the number of the one that is
/// meant, and how many there are.
const STACKS: [(&str, u16, u16); 4] =
    [("CONTROL", 0, 1), ("WORKERS", 0, 2), ("WORKERS", 1, 2), ("REPORTER", 0, 1)];

/// The most cycles of a switch between where its time is charged and where the running task is another one.
/// With interrupts in between it may be more, but seldom.
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
    // The cycles that each was the running task, and how often it became that.
    let mut cycles = [0; 5];
    let mut switches = [0; 5];
    let mut before = (mcu.cycle(), 3);
    while mcu.markers().last().map(|mark| mark.value) != Some(DONE) {
        let [low, high] = [running, running + 1].map(|address| mcu.read(address).expect("there is RAM"));
        // Between the stores of its two bytes it is none of them.
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

/// Where the static lies whose mangled name ends like this, and its size.
fn data(mcu: &Mcu, name: &str) -> (u16, u16) {
    let mut all = mcu.image().symbols().filter(|(mangled, _)| mangled.ends_with(name));
    match all.next().map(|(_, symbol)| (symbol.place, symbol.size)) {
        Some((Place::Data(start), size)) => (start, size),
        _ => panic!("the image has no {name}"),
    }
}
