//! Shows the joints' control on a timeline: when it computes, and how much of its period is left.

use serde_json::json;
use simavr_harness::Edge;
use simulation::MILLISECOND;

use super::events::{Events, Track};

/// A period of the control, in cycles. The control has to be done before the next period begins.
const PERIOD: u64 = MILLISECOND;

/// Cycles in a microsecond.
const MICROSECOND: u64 = MILLISECOND / 1000;

/// Writes the slices in which the control computes, from the edges of its probe. `end` is the end of the run.
pub fn write(events: &mut Events, track: Track, edges: &[Edge], end: u64) {
    let mut begins = None;
    for &Edge { cycle, level } in edges {
        match begins {
            None if level => {
                if edges.first().is_some_and(|first| first.cycle == cycle) {
                    events.name_track(track, "joints");
                }
                begins = Some(cycle);
            }
            Some(begin) if !level => {
                control(events, track, begin, cycle);
                begins = None;
            }
            _ => {}
        }
    }
    if let Some(begin) = begins.filter(|&begin| begin < end) {
        control(events, track, begin, end);
    }
}

fn control(events: &mut Events, track: Track, begin: u64, end: u64) {
    let left = (begin + PERIOD).checked_sub(end);
    let name = if left.is_some() { "control" } else { "control, too late" };
    let args = left.map(|left| json!({ "µs left to the deadline": left / MICROSECOND }));
    events.begin(track, begin, "joints", name, args.unwrap_or_default());
    events.end(track, end);
}
