//! What interrupts cost: from the acceptance of one to the task that it wakes, or back to the task that it struck.

use std::ops::RangeInclusive;

use super::{BEFORE_OUT, BenchError, END, Measured, TestImages, unmeasurable};
use crate::image::{Image, Place};
use crate::mcu::{Mcu, Pin};

/// The pin of external interrupt 4.
const BUTTON: Pin = Pin { port: 'E', bit: 4 };

/// More cycles than the start of an image, or anything that is measured here, takes.
const PATIENCE: u64 = 1_000_000;

/// Bytes that an interrupt pushes.
const RETURN_ADDRESS: u16 = 2;

/// At how many places the interrupt strikes the busy task.
const STRIKES: u64 = 200;

pub(super) fn measure(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    let mut measured = measure_button(images)?;
    measured.extend(measure_ticks(images)?);
    Ok(measured)
}

// --- An external interrupt ----------------------------------------------------------------------

/// Marks of `bench_interrupt`.
const WOKEN: u8 = END | 1;
const BUSY_BEGINS: u8 = 2;

fn measure_button(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    const IMAGE: &str = "bench_interrupt";
    let mut mcu = images.mcu(IMAGE)?;
    let stack = data_of(mcu.image(), "BUSY").ok_or_else(|| unmeasurable(IMAGE, "it has no stack BUSY"))?;
    mcu.drive_pin(BUTTON, false);
    mcu.run_to_marker(BUSY_BEGINS, PATIENCE)
        .ok_or_else(|| unmeasurable(IMAGE, "its task does not become busy"))?;
    let (mut latency, mut context) = (0, 0);
    for strike in 0..STRIKES {
        mcu.run_until(mcu.cycle() + 1_000 + strike);
        mcu.take_markers();
        let (pressed, stack_pointer) = (mcu.cycle(), mcu.stack_pointer());
        let mut lowest = stack_pointer;
        mcu.drive_pin(BUTTON, true);
        while mcu.markers().is_empty() && mcu.cycle() < pressed + PATIENCE {
            if stack.contains(&mcu.stack_pointer()) {
                lowest = lowest.min(mcu.stack_pointer());
            }
            mcu.step();
        }
        mcu.drive_pin(BUTTON, false);
        match mcu.markers() {
            [woken] if woken.value == WOKEN => latency = latency.max(woken.cycle - BEFORE_OUT - pressed),
            marks => return Err(unmeasurable(IMAGE, format!("the press at {pressed} led to {marks:?}"))),
        }
        context = context.max(u64::from(stack_pointer - lowest));
    }
    Ok(vec![
        Measured::new("isr_to_task_cycles", latency),
        Measured::new("preempted_context_bytes", context),
    ])
}

/// The addresses of a variable.
fn data_of(image: &Image, name: &str) -> Option<RangeInclusive<u16>> {
    let symbol = image.symbol(name)?;
    match symbol.place {
        Place::Data(start) => Some(start..=start + symbol.size.checked_sub(1)?),
        _ => None,
    }
}

// --- Ticks --------------------------------------------------------------------------------------

/// Number of the stretch of `bench_tick` in which the task is busy, figure.
const BUSY_STRETCHES: [(u8, &str); 4] =
    [(1, "tick_cycles_0"), (2, "tick_cycles_1"), (3, "tick_cycles_10"), (4, "tick_cycles_50")];

/// The mark of `bench_tick` behind a delay.
const DELAYED: u8 = END | 5;

fn measure_ticks(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    const IMAGE: &str = "bench_tick";
    let mut mcu = images.mcu(IMAGE)?;
    let mut measured = Vec::new();
    for (number, name) in BUSY_STRETCHES {
        mcu.run_to_marker(number, PATIENCE)
            .ok_or_else(|| unmeasurable(IMAGE, format!("it has no stretch {number}, for {name}")))?;
        let cycles = longest_interrupt(&mut mcu, END | number)
            .ok_or_else(|| unmeasurable(IMAGE, format!("no tick strikes in stretch {number}, for {name}")))?;
        measured.push(Measured::new(name, cycles));
    }
    let latency = longest_wake_up(&mut mcu)
        .ok_or_else(|| unmeasurable(IMAGE, "no task runs after its delay"))?;
    measured.push(Measured::new("tick_to_task_cycles", latency));
    Ok(measured)
}

/// Up to the mark `end`: the most cycles from the acceptance of an interrupt until the code that it struck goes on.
fn longest_interrupt(mcu: &mut Mcu, end: u8) -> Option<u64> {
    let mut longest = None;
    let mut struck = None;
    while mcu.is_alive() && mcu.markers().last().is_none_or(|marker| marker.value != end) {
        if let Some(accepted) = mcu.step() {
            struck = Some((mcu.cycle() - accepted.response_cycles, mcu.stack_pointer() + RETURN_ADDRESS));
        }
        if let Some((at, stack_pointer)) = struck
            && mcu.interrupts_enabled()
            && mcu.stack_pointer() == stack_pointer
        {
            longest = longest.max(Some(mcu.cycle() - at));
            struck = None;
        }
    }
    longest
}

/// Up to the program's end: the most cycles from the acceptance of a tick to the task whose delay it ended.
fn longest_wake_up(mcu: &mut Mcu) -> Option<u64> {
    let mut longest = None;
    let mut accepted_at = None;
    while mcu.is_alive() {
        if let Some(accepted) = mcu.step() {
            accepted_at = Some(mcu.cycle() - accepted.response_cycles);
        }
        if let [.., marker] = mcu.take_markers()[..]
            && marker.value == DELAYED
        {
            longest = longest.max(Some(marker.cycle - BEFORE_OUT - accepted_at?));
        }
    }
    longest
}
