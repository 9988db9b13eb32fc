//! The kernel's primitives on each MCU: the order of events, and the cycles between them.

use std::path::Path;

use simavr_harness::State;
use superbot_tests_simavr::marks::{expect, values};
use superbot_tests_simavr::target::{TARGETS, Target};
use superbot_tests_simavr::{MILLISECOND, mcu};

/// More cycles than any of these images needs.
const LIMIT: u64 = 4_000_000;

fn runs_as_expected(name: &str) {
    let all = TARGETS.map(|target| {
        let mut mcu = target.mcu(target.image(name));
        assert_eq!(mcu.run_to_end(LIMIT), State::Done, "{name} on {}", target.part.name);
        expect(&Path::new(target.folder()).join(name), mcu.markers());
        values(mcu.markers())
    });
    assert!(all.iter().all(|marks| *marks == all[0]), "{name} does the same on all: {all:02x?}");
}

#[test]
fn preemption_and_turns() {
    runs_as_expected("preemption");
}

#[test]
fn semaphores_count_and_wake_by_priority() {
    runs_as_expected("semaphore");
}

#[test]
fn queues_keep_order_and_refuse_when_full() {
    runs_as_expected("queue");
}

#[test]
fn delays_and_timers_end_on_their_tick() {
    runs_as_expected("timer");
}

/// The most cycles from the edge to the woken task's mark.
const LATENCY: u64 = 220;

/// The additional cycles where a return address has 3 bytes.
const LONGER: u64 = 8;

#[test]
fn an_interrupt_wakes_a_task_wherever_it_comes() {
    for target in TARGETS {
        let image = target.image("interrupt");
        // A program counter of 3 bytes makes each call and return a cycle longer.
        let latency_limit = LATENCY + if target.part.return_address == 3 { LONGER } else { 0 };
        for interruption in 0..300 {
            let mut mcu = target.mcu(image.clone());
            mcu.drive_pin(target.button, false);
            // The busy task marks 1 first, and 3 after each sum that came out right.
            let busy = mcu.run_to_marker(1, LIMIT).expect("the busy task runs").cycle;
            for press in 1..=3 {
                mcu.run_until(busy + 3_000 * press + interruption);
                mcu.take_markers();
                let pressed = mcu.cycle();
                let place = format!("{}, interrupted at {pressed}", target.part.name);
                mcu.drive_pin(target.button, true);
                let woken = mcu.run_to_marker(2, LATENCY + 50).expect("the woken task runs at once");
                let latency = woken.cycle - pressed;
                assert!(latency <= latency_limit, "{place}: {latency} cycles to the woken task");
                mcu.drive_pin(target.button, false);
                assert!(mcu.markers().iter().all(|marker| marker.value != 0xff), "{place}: a wrong sum");
            }
            assert_eq!(mcu.run_to_end(LIMIT), State::Done);
        }
    }
}

#[test]
fn a_preempted_task_keeps_its_rampz() {
    for (mcu, pages) in [("atmega128", 2), ("atmega1284p", 2), ("atmega2560", 4)] {
        let target = Target::named(mcu).expect("it is one of them");
        let mut mcu = target.mcu(target.image("rampz"));
        for page in 0..pages {
            mcu.drive_pin(target.button, false);
            mcu.run_to_marker(1, LIMIT).expect("the busy task runs");
            mcu.take_markers();
            mcu.drive_pin(target.button, true);
            mcu.run_to_marker(0x10 + page, LIMIT).expect("RAMPZ is kept");
            assert_eq!(values(mcu.markers()), [2, 0x10 + page], "{}", target.part.name);
        }
        assert_eq!(mcu.run_to_end(LIMIT), State::Done);
    }
}

/// "The instruction following SEI will be executed before any pending interrupts" (ATmega128 datasheet,
/// "Reset and Interrupt Handling"), also when a pin changes right then. The kernel sets the stack pointer's
/// two halves around `sei`.
#[test]
fn the_instruction_after_sei_runs_before_an_interrupt_from_outside() {
    for target in TARGETS {
        let mut mcu = target.mcu(target.image("interrupt"));
        mcu.drive_pin(target.button, false);
        // The kernel enables interrupts when it starts the first task.
        while !mcu.interrupts_enabled() {
            mcu.step();
        }
        let next = mcu.pc();
        mcu.drive_pin(target.button, true);
        assert_eq!(mcu.pc(), next, "accepted before the instruction behind SEI");
        assert!(mcu.step().is_some(), "accepted after it");
    }
}

#[test]
fn the_kernel_starts_once() {
    for target in TARGETS {
        let mut mcu = target.mcu(target.image("rerun"));
        target.enable_interrupts(&mut mcu);
        while mcu.is_alive() && mcu.cycle() < LIMIT {
            mcu.run_until(mcu.cycle() + 1000);
            mcu.raise_interrupt(target.tick.vector);
        }
        assert_eq!(mcu.state(), State::Done, "{}", target.part.name);
        assert_eq!(values(mcu.markers()), [1, 2, 3, 4, 5], "{}", target.part.name);
    }
}

#[test]
fn time_goes_on_where_no_timer_is_armed() {
    const MILLISECOND: u64 = 16_000;
    for target in TARGETS {
        let mut mcu = target.mcu(target.image("quiet"));
        mcu.drive_pin(target.button, false);
        let mut first = None;
        // In between more than the longest time that can be asked for, when the ticks are counted anew.
        for at in [1_000, 40_000, 80_000, 200_000] {
            mcu.run_until(at * MILLISECOND + MILLISECOND / 2);
            mcu.take_markers();
            mcu.drive_pin(target.button, true);
            mcu.run_until((at + 8) * MILLISECOND);
            mcu.drive_pin(target.button, false);
            let marks = mcu.take_markers();
            let [pressed, once, twice] = marks[..] else { panic!("at {at} ms: {marks:?}") };
            let now = u64::from(pressed.value);
            let &mut (first_now, first_at) = first.get_or_insert((now, at));
            // The clock runs on the board's crystal: at most a tick begins in between.
            let passed = [at - first_at, at - first_at + 1].map(|ticks| (first_now + ticks) & 0x7f);
            assert!(passed.contains(&now), "at {at} ms the tick is {now}, where one of {passed:?} should be");
            assert_eq!([once.value, twice.value], [0x80, 0x81]);
            let ticks = (twice.cycle - once.cycle).div_ceil(MILLISECOND / 4);
            assert!((11..=13).contains(&ticks), "3 ticks at {at} ms: {} cycles", twice.cycle - once.cycle);
        }
    }
}

#[test]
fn a_handler_calls_what_the_program_calls_so() {
    let mut mcu = mcu("board_names");
    mcu.run_until(MILLISECOND);
    for _ in 0..3 {
        assert!(mcu.raise_interrupt(5));
        mcu.run_until(mcu.cycle() + 1000);
    }
    assert_eq!(values(mcu.markers()), [1, 1, 1]);
}
