//! The kernel's primitives on the MCU: what happens in which order, and in how many cycles.

use simavr_harness::{Mcu, State};
use superbot_tests_simavr::{expect, mcu};

/// More cycles than any of these images needs.
const LIMIT: u64 = 4_000_000;

fn runs_as_expected(name: &str) {
    let mut mcu = mcu(name);
    assert_eq!(mcu.run_to_end(LIMIT), State::Done, "{name}");
    expect(name, mcu.markers());
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

/// External interrupt 4.
const INT4: u8 = 5;

#[test]
fn an_interrupt_wakes_a_task_wherever_it_strikes() {
    let mut mcu = mcu("interrupt");
    // The busy task marks 1, then 3 after each sum that came out right.
    let busy = mcu.run_to_marker(1, LIMIT).expect("the busy task runs").cycle;
    for press in 1..=3 {
        let mut target = busy + 20_000 * press + 137 * press;
        mcu.run_until(target);
        // A task between two markers is struck at a different instruction each time.
        mcu.take_markers();
        mcu.raise_interrupt(INT4);
        target += 400;
        mcu.run_until(target);
        let woken = mcu.markers().iter().find(|marker| marker.value == 2).map(|marker| marker.cycle);
        let latency = woken.expect("the woken task runs at once") - (target - 400);
        assert!(latency <= 200, "press {press}: {latency} cycles from the interrupt to the woken task");
    }
    assert!(!markers_of(&mcu).contains(&0xff), "a register was lost");
}

fn markers_of(mcu: &Mcu) -> Vec<u8> {
    mcu.markers().iter().map(|marker| marker.value).collect()
}
