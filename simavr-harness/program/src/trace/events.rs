//! Trace events as Perfetto and Chrome read them (Google's document "Trace Event Format"), as JSON.

use serde::Serialize;
use serde_json::Value;
use simulation::CLOCK_HZ;

/// Cycles in a microsecond, the unit of time in the file. A cycle is a sixteenth: no digit is lost.
const MICROSECOND: f64 = CLOCK_HZ as f64 / 1e6;

/// Tracks that a process may have, so that no two tracks of the file have the same number.
const TRACKS: usize = 100;

/// A line of the timeline.
#[derive(Clone, Copy)]
pub struct Track {
    process: usize,
    /// From 0.
    number: usize,
}

impl Track {
    /// Track `number`, counted from 0, of an MCU, counted from 0 likewise.
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

/// The events of a file, one behind the other.
#[derive(Default)]
pub struct Events {
    text: String,
    flows: usize,
}

/// One event. What the kind of event does not need is left out.
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
    /// Names an MCU. They are shown in the order of their numbers.
    pub fn name_mcu(&mut self, mcu: usize, name: &str) {
        let track = Track::new(mcu, 0);
        self.describe("process_name", track, serde_json::json!({ "name": name }));
        self.describe("process_sort_index", track, serde_json::json!({ "sort_index": mcu }));
    }

    /// Names a track. They are shown in the order of their numbers.
    pub fn name_track(&mut self, track: Track, name: &str) {
        self.describe("thread_name", track, serde_json::json!({ "name": name }));
        self.describe("thread_sort_index", track, serde_json::json!({ "sort_index": track.number }));
    }

    fn describe(&mut self, name: &str, track: Track, args: Value) {
        self.push(&Event { name: Some(name), args, ..Event::new("M", track) });
    }

    /// A slice begins. The slices of a track nest.
    pub fn begin(&mut self, track: Track, cycle: u64, category: &str, name: &str, args: Value) {
        let event = Event { name: Some(name), cat: Some(category), args, ..Event::new("B", track) };
        self.push(&event.at(cycle));
    }

    /// The slice that began last on the track ends.
    pub fn end(&mut self, track: Track, cycle: u64) {
        self.push(&Event::new("E", track).at(cycle));
    }

    /// An arrow leads from the slice in which one moment lies to the one in which the other lies.
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
        // Numbers, text and values of these can always be written.
        self.text += &serde_json::to_string(event).unwrap_or_default();
    }
}
