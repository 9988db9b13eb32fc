//! Writes trace events for Perfetto and Chrome (Google's document "Trace Event Format"), as JSON.

use serde::Serialize;
use serde_json::Value;
use simulation::CLOCK_HZ;

/// Cycles in a microsecond, the unit of time in the file. A cycle is 1/16 us, which decimals represent
/// exactly.
const MICROSECOND: f64 = CLOCK_HZ as f64 / 1e6;

/// The numbers reserved for the tracks of a process, so that no two tracks of the file have the same number.
const TRACKS: usize = 100;

/// A line of the timeline.
#[derive(Clone, Copy)]
pub struct Track {
    process: usize,
    /// From 0.
    number: usize,
}

impl Track {
    /// Track `number` of MCU `mcu`, both counted from 0.
    pub fn new(mcu: usize, number: usize) -> Self {
        Track { process: mcu, number }
    }

    fn pid(self) -> usize {
        (self.process + 1) * TRACKS
    }

    fn tid(self) -> usize {
        self.pid() + 1 + self.number
    }
}

/// The events of a file, one after the other.
#[derive(Default)]
pub struct Events {
    text: String,
    flows: usize,
}

/// One event. Fields that its kind does not need are left out.
#[derive(Serialize)]
struct Event<'a> {
    ph: &'a str,
    pid: usize,
    tid: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    ts: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cat: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bp: Option<&'a str>,
    #[serde(skip_serializing_if = "Value::is_null")]
    args: Value,
}

impl<'a> Event<'a> {
    fn new(ph: &'a str, track: Track) -> Self {
        let (pid, tid) = (track.pid(), track.tid());
        Event { ph, pid, tid, ts: None, name: None, cat: None, id: None, bp: None, args: Value::Null }
    }

    fn at(self, cycle: u64) -> Self {
        Event { ts: Some(cycle as f64 / MICROSECOND), ..self }
    }
}

impl Events {
    /// Names an MCU. MCUs are shown in the order of their numbers.
    pub fn name_mcu(&mut self, mcu: usize, name: &str) {
        let track = Track::new(mcu, 0);
        self.describe("process_name", track, serde_json::json!({ "name": name }));
        self.describe("process_sort_index", track, serde_json::json!({ "sort_index": mcu }));
    }

    /// Names a track. Tracks are shown in the order of their numbers.
    pub fn name_track(&mut self, track: Track, name: &str) {
        self.describe("thread_name", track, serde_json::json!({ "name": name }));
        self.describe("thread_sort_index", track, serde_json::json!({ "sort_index": track.number }));
    }

    fn describe(&mut self, name: &str, track: Track, args: Value) {
        self.push(&Event { name: Some(name), args, ..Event::new("M", track) });
    }

    /// Begins a slice. The slices of a track nest.
    pub fn begin(&mut self, track: Track, cycle: u64, category: &str, name: &str, args: Value) {
        let event = Event { name: Some(name), cat: Some(category), args, ..Event::new("B", track) };
        self.push(&event.at(cycle));
    }

    /// Ends the slice that began last on the track.
    pub fn end(&mut self, track: Track, cycle: u64) {
        self.push(&Event::new("E", track).at(cycle));
    }

    /// Draws an arrow from the slice at one moment to the slice at another.
    pub fn flow(&mut self, name: &str, from: (Track, u64), to: (Track, u64)) {
        self.flows += 1;
        let id = Some(self.flows);
        let event = |ph, (track, cycle): (Track, u64)| Event {
            name: Some(name),
            cat: Some("flow"),
            id,
            ..Event::new(ph, track).at(cycle)
        };
        self.push(&event("s", from));
        self.push(&Event { bp: Some("e"), ..event("f", to) });
    }

    /// All events as a file.
    pub fn finish(self) -> String {
        let Self { text, .. } = self;
        format!("{{\"displayTimeUnit\":\"ns\",\"traceEvents\":[\n{text}\n]}}\n")
    }

    fn push(&mut self, event: &Event) {
        if !self.text.is_empty() {
            self.text += ",\n";
        }
        // An event has only numbers and text, so serialising does not fail.
        self.text += &serde_json::to_string(event).unwrap_or_default();
    }
}
