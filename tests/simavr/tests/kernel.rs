//! The kernel's primitives on the MCU: what happens in which order, and in how many cycles.

use simavr_harness::{Pin, State};
use superbot_tests_simavr::marks::expect;
use superbot_tests_simavr::mcu;

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

/// The pin of external interrupt 4, which the image waits for.
const BUTTON: Pin = Pin { port: 'E', bit: 4 };

/// The most cycles from the edge to the woken task's mark.
const LATENCY: u64 = 220;

#[test]
fn an_interrupt_wakes_a_task_wherever_it_strikes() {
    for strike in 0..300 {
        let mut mcu = mcu("interrupt");
        mcu.drive_pin(BUTTON, false);
        // The busy task marks 1 first, and 3 after each sum that came out right.
        let busy = mcu.run_to_marker(1, LIMIT).expect("the busy task runs").cycle;
        for press in 1..=3 {
            mcu.run_until(busy + 3_000 * press + strike);
            mcu.take_markers();
            let pressed = mcu.cycle();
            mcu.drive_pin(BUTTON, true);
            let woken = mcu.run_to_marker(2, LATENCY + 50).expect("the woken task runs at once");
            let latency = woken.cycle - pressed;
            assert!(latency <= LATENCY, "struck at {pressed}: {latency} cycles to the woken task");
            mcu.drive_pin(BUTTON, false);
            assert!(
                mcu.markers().iter().all(|marker| marker.value != 0xff),
                "struck at {pressed}: a wrong sum"
            );
        }
        assert_eq!(mcu.run_to_end(LIMIT), State::Done);
    }
}

/// "The instruction following SEI will be executed before any pending interrupts" (ATmega128 datasheet, "Reset and
/// Interrupt Handling"), also when the outside acts right then: the kernel sets the stack pointer's two halves around it.
#[test]
fn the_instruction_after_sei_runs_before_an_interrupt_from_outside() {
    let mut mcu = mcu("interrupt");
    mcu.drive_pin(BUTTON, false);
    // The kernel enables interrupts when it starts the first task.
    while !mcu.interrupts_enabled() {
        mcu.step();
    }
    let next = mcu.pc();
    mcu.drive_pin(BUTTON, true);
    assert_eq!(mcu.pc(), next, "accepted before the instruction behind SEI");
    assert!(mcu.step().is_some(), "accepted after it");
}
