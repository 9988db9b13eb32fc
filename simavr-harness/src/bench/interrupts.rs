//! Measures the cost of interrupts: from the acceptance to the task that the interrupt wakes, or back to the
//! task that it interrupted.

use std::collections::BTreeMap;
use std::ops::{Range, RangeInclusive};

use super::{BEFORE_OUT, BenchError, END, Measured, Stretch, TestImages, keep_longest, unmeasurable};
use crate::image::{Image, Place};
use crate::mcu::Mcu;
use crate::part::Pin;

/// The pin of external interrupt 4.
pub(super) const BUTTON: Pin = Pin { port: 'E', bit: 4 };

/// A limit in cycles, more than the start of an image or any stretch that is measured here takes.
const PATIENCE: u64 = 1_000_000;

/// The value to which unused bytes of a stack are set.
const PAINT: u8 = 0xa5;

/// Bytes of the control block before a stack.
const CONTROL_BLOCK: u16 = 6;

/// Bytes that an interrupt pushes.
const RETURN_ADDRESS: u16 = 2;

/// Cycles after which the busy task is in its loop.
const SETTLED: u64 = 100;

/// The number of instants, one cycle apart, at which the interrupt comes while the busy task runs.
const INTERRUPTIONS: u64 = 200;

pub(super) fn measure(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    let mut measured = measure_button(images)?;
    measured.extend(measure_ticks(images)?);
    Ok(measured)
}

// --- An external interrupt ----------------------------------------------------------------------

const BUTTON_IMAGE: &str = "bench_interrupt";

/// Marks of the image.
const WOKEN: u8 = END | 1;
const BUSY_BEGINS: u8 = 2;

fn measure_button(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    let (mut latency, mut masked, mut context) = (None, None, 0);
    for interruption in 0..INTERRUPTIONS {
        let press = press(images, interruption)?;
        keep_longest(&mut latency, press.latency);
        keep_longest(&mut masked, press.masked);
        context = context.max(press.context);
    }
    let figure = |name, cycles: Option<_>| {
        let cycles = cycles.ok_or_else(|| unmeasurable(BUTTON_IMAGE, "no press woke a task"))?;
        let stretch = Stretch { begins_with_press: true, ..Stretch::of(BUTTON_IMAGE, cycles) };
        Ok::<_, BenchError>(Measured::cycles(name, stretch))
    };
    Ok(vec![
        figure("isr_to_task_cycles", latency)?,
        figure("masked_cycles_isr_usual", masked)?,
        Measured::number("preempted_context_bytes", context.into()),
    ])
}

/// The outcome of one press of the button.
struct Press {
    /// From the acceptance of the interrupt to the first instruction of the woken task.
    latency: Range<u64>,
    /// From its acceptance until interrupts were enabled again.
    masked: Range<u64>,
    /// Bytes on the stack of the task that was busy.
    context: u16,
}

/// Presses the button `SETTLED + interruption` cycles after the task has become busy, rounded up to the next
/// instruction.
fn press(images: &TestImages, interruption: u64) -> Result<Press, BenchError> {
    let fault = |reason| unmeasurable(BUTTON_IMAGE, reason);
    let mut mcu = images.mcu(BUTTON_IMAGE)?;
    let stack = data_of(mcu.image(), "BUSY").ok_or_else(|| fault("it has no stack BUSY"))?;
    let busy = mcu.run_to_marker(BUSY_BEGINS, PATIENCE);
    let busy = busy.ok_or_else(|| fault("its task does not become busy"))?;
    mcu.run_until(busy.cycle + SETTLED + interruption);
    mcu.take_markers();
    let (pressed, stack_pointer) = (mcu.cycle(), mcu.stack_pointer());
    let unused = *stack.start() + CONTROL_BLOCK..=stack_pointer;
    unused.clone().for_each(|address| mcu.write(address, PAINT));
    let mut enabled = None;
    mcu.drive_pin(BUTTON, true);
    while mcu.markers().is_empty() && mcu.cycle() < pressed + PATIENCE {
        mcu.step();
        if mcu.interrupts_enabled() {
            enabled = enabled.or(Some(mcu.cycle()));
        }
    }
    match (mcu.markers(), enabled) {
        ([woken], Some(enabled)) if woken.value == WOKEN => Ok(Press {
            latency: pressed..woken.cycle - BEFORE_OUT,
            masked: pressed..enabled,
            context: unused.skip_while(|&address| mcu.read(address) == Some(PAINT)).count() as u16,
        }),
        _ => Err(fault("a press of the button does not wake its task")),
    }
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

/// Number of the stretch of `bench_tick` that ends when a task runs whose wait has ended, figure.
const WAKE_UPS: [(u8, &str); 3] =
    [(5, "tick_to_task_cycles"), (6, "tick_to_task_by_timer_cycles"), (7, "tick_to_task_by_timeout_cycles")];

fn measure_ticks(images: &TestImages) -> Result<Vec<Measured>, BenchError> {
    const IMAGE: &str = "bench_tick";
    let mut mcu = images.mcu(IMAGE)?;
    let mut measured = Vec::new();
    for (number, name) in BUSY_STRETCHES {
        mcu.run_to_marker(number, PATIENCE)
            .ok_or_else(|| unmeasurable(IMAGE, format!("it has no stretch {number}, for {name}")))?;
        let cycles = longest_interrupt(&mut mcu, END | number)
            .ok_or_else(|| unmeasurable(IMAGE, format!("no tick occurs in stretch {number}, for {name}")))?;
        measured.push(Measured::cycles(name, Stretch::of(IMAGE, cycles)));
    }
    let longest = longest_wake_ups(&mut mcu);
    for (number, name) in WAKE_UPS {
        let latency = longest.get(&(END | number)).cloned().flatten();
        let latency = latency.ok_or_else(|| unmeasurable(IMAGE, format!("no task wakes up for {name}")))?;
        measured.push(Measured::cycles(name, Stretch::of(IMAGE, latency)));
    }
    Ok(measured)
}

/// The longest time from the acceptance of an interrupt until the interrupted code resumes, up to the mark
/// `end`.
fn longest_interrupt(mcu: &mut Mcu, end: u8) -> Option<Range<u64>> {
    let mut longest = None;
    let mut interrupted = None;
    while mcu.is_alive() && mcu.markers().last().is_none_or(|marker| marker.value != end) {
        if let Some(accepted) = mcu.step() {
            interrupted =
                Some((mcu.cycle() - accepted.response_cycles, mcu.stack_pointer() + RETURN_ADDRESS));
        }
        if let Some((at, stack_pointer)) = interrupted
            && mcu.interrupts_enabled()
            && mcu.stack_pointer() == stack_pointer
        {
            keep_longest(&mut longest, at..mcu.cycle());
            interrupted = None;
        }
    }
    longest
}

/// The longest time, over some waits, from the acceptance of a tick to each mark after the end of a wait.
fn longest_wake_ups(mcu: &mut Mcu) -> BTreeMap<u8, Option<Range<u64>>> {
    let mut longest = BTreeMap::new();
    let mut accepted_at = mcu.cycle();
    let end = mcu.cycle() + PATIENCE;
    mcu.take_markers();
    while mcu.is_alive() && mcu.cycle() < end {
        if let Some(accepted) = mcu.step() {
            accepted_at = mcu.cycle() - accepted.response_cycles;
        }
        for marker in mcu.take_markers() {
            keep_longest(longest.entry(marker.value).or_default(), accepted_at..marker.cycle - BEFORE_OUT);
        }
    }
    longest
}
