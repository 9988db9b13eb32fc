//! Shows an MCU's tasks and interrupts on a timeline.

use serde_json::{Value, json};
use simavr_harness::{Holder, TaskState, Trace, Wait};
use stack_bound::vectors;

use super::events::{Events, Track};

/// The track of the holders of the CPU, with interrupts nested in them.
const CPU: usize = 0;

/// The first track of a task; the others follow.
const FIRST_TASK: usize = 1;

/// The number of tracks that the schedule of an MCU takes.
pub fn tracks(trace: &Trace) -> usize {
    FIRST_TASK + trace.tasks.len()
}

/// The track of the task of this name.
pub fn track(mcu: usize, trace: &Trace, task: &str) -> Option<Track> {
    let number = trace.tasks.iter().position(|traced| &*traced.name == task)?;
    Some(Track::new(mcu, FIRST_TASK + number))
}

/// Writes the schedule of MCU number `mcu` of the file.
pub fn write(events: &mut Events, mcu: usize, trace: &Trace) {
    write_cpu(events, Track::new(mcu, CPU), trace);
    for (number, task) in trace.tasks.iter().enumerate() {
        let track = Track::new(mcu, FIRST_TASK + number);
        events.name_track(track, &task.name);
        for slice in &task.states {
            let (name, args) = state(&slice.what);
            events.begin(track, slice.begin, "task", &name, args);
            events.end(track, slice.end);
        }
    }
}

/// Writes the track of the CPU. Interrupts are nested in the holder or interrupt that they interrupt.
fn write_cpu(events: &mut Events, track: Track, trace: &Trace) {
    events.name_track(track, "CPU");
    let holders = trace.cpu.iter().map(|slice| {
        let name = match slice.what {
            Holder::Reset => "reset",
            Holder::Start => "start",
            Holder::Idle => "idle",
            Holder::Sleep => "sleep",
            Holder::Task(index) => &trace.tasks[index].name,
        };
        (slice.begin, slice.end, "cpu", name)
    });
    let interrupts = trace.interrupts.iter().map(|slice| {
        let name = vectors::name(slice.what).unwrap_or("interrupt");
        (slice.begin, slice.end, "interrupt", name)
    });
    let mut slices: Vec<_> = holders.chain(interrupts).collect();
    // Of two slices with the same begin the longer one comes first, and so a holder before its interrupts.
    slices.sort_by_key(|&(begin, end, ..)| (begin, u64::MAX - end));
    let mut under_way: Vec<u64> = Vec::new();
    for (begin, end, category, name) in slices {
        while let Some(before) = under_way.pop_if(|before| *before <= begin) {
            events.end(track, before);
        }
        events.begin(track, begin, category, name, Value::Null);
        under_way.push(end);
    }
    while let Some(end) = under_way.pop() {
        events.end(track, end);
    }
}

/// The name of a task's state, and its details.
fn state(state: &TaskState) -> (String, Value) {
    let args = match state {
        TaskState::Waiting(Wait { ticks: Some(ticks), .. }) => json!({ "ticks at most": ticks }),
        _ => Value::Null,
    };
    (state.to_string(), args)
}
