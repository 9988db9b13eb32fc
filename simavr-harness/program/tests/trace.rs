//! Tests `./x sim --trace`: reads a timeline as Perfetto does, and compares it with the summary.

mod command;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use command::run;
use serde_json::Value;

/// Cycles in a microsecond, the unit of time in the file.
const MICROSECOND: f64 = 16.0;

/// A file that no other test writes.
fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{name}", std::process::id()))
}

/// Runs with a trace, and returns the summary and the trace.
fn traced(name: &str, arguments: &[&str]) -> (Value, Timeline) {
    let path = file(name);
    let path_text = path.to_str().expect("the path is text");
    let output = run(&[&["sim"], arguments, &["--json", "-", "--trace", path_text]].concat());
    let error = String::from_utf8_lossy(&output.stderr);
    let report = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{error}"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|_| panic!("{error}"));
    std::fs::remove_file(&path).expect("it can be removed");
    (report, Timeline::of(&serde_json::from_str(&text).expect("the trace is JSON")))
}

/// A slice of a track.
#[derive(Debug)]
struct Slice {
    name: String,
    begin: u64,
    end: u64,
    /// The number of slices around it.
    depth: usize,
}

/// An arrow: its name, and its ends by process, track and cycle.
type Arrow = (String, Vec<(u64, u64, u64)>);

/// An end of an arrow: MCU, track and cycle.
type End = (String, String, u64);

/// A trace, by the names of MCUs and tracks.
struct Timeline {
    tracks: BTreeMap<(String, String), Vec<Slice>>,
    /// By their numbers: name, and both ends.
    flows: BTreeMap<u64, (String, Vec<End>)>,
}

impl Timeline {
    /// Pairs begins and ends, as Perfetto does.
    fn of(file: &Value) -> Self {
        let mut names: BTreeMap<(&str, u64), &str> = BTreeMap::new();
        let mut open: BTreeMap<u64, Vec<(String, u64)>> = BTreeMap::new();
        let mut slices: BTreeMap<(u64, u64), Vec<Slice>> = BTreeMap::new();
        let mut flows: BTreeMap<u64, Arrow> = BTreeMap::new();
        for event in file["traceEvents"].as_array().expect("there are events") {
            let number = |field: &str| event[field].as_u64().unwrap_or_else(|| panic!("{field} of {event}"));
            let cycle = || {
                let cycles = event["ts"].as_f64().expect("it has a time") * MICROSECOND;
                assert_eq!(cycles, cycles.round(), "{event} is between two cycles");
                cycles as u64
            };
            let (pid, tid) = (number("pid"), number("tid"));
            let under_way = open.entry(tid).or_default();
            match event["ph"].as_str() {
                Some("M") => {
                    let name = event["args"]["name"].as_str();
                    match event["name"].as_str() {
                        Some("process_name") => drop(names.insert(("mcu", pid), name.expect("a name"))),
                        Some("thread_name") => drop(names.insert(("track", tid), name.expect("a name"))),
                        _ => {}
                    }
                }
                Some("B") => under_way.push((event["name"].as_str().expect("a name").into(), cycle())),
                Some("E") => {
                    let (name, begin) = under_way.pop().expect("what ends has begun");
                    let slice = Slice { name, begin, end: cycle(), depth: under_way.len() };
                    assert!(slice.begin < slice.end, "{slice:?}");
                    slices.entry((pid, tid)).or_default().push(slice);
                }
                Some(ph @ ("s" | "f")) => {
                    let name = event["name"].as_str().expect("a name").to_owned();
                    let flow = flows.entry(number("id")).or_insert_with(|| (name.clone(), Vec::new()));
                    assert_eq!(flow.0, name);
                    assert_eq!(ph, ["s", "f"][flow.1.len()], "a flow starts and finishes, once");
                    flow.1.push((pid, tid, cycle()));
                }
                _ => panic!("{event}"),
            }
        }
        assert!(open.values().all(Vec::is_empty), "what has begun ends");
        let name = |key| names.get(&key).map(|&name| name.to_owned()).expect("it has a name");
        let named = |((pid, tid), slices)| ((name(("mcu", pid)), name(("track", tid))), slices);
        let ends = |(id, (text, ends)): (u64, Arrow)| {
            assert_eq!(ends.len(), 2, "{text} has both ends");
            let ends = ends.into_iter();
            let ends = ends.map(|(pid, tid, cycle)| (name(("mcu", pid)), name(("track", tid)), cycle));
            (id, (text, ends.collect()))
        };
        Timeline {
            flows: flows.into_iter().map(ends).collect(),
            tracks: slices.into_iter().map(named).collect(),
        }
    }

    /// The slice in which an end of an arrow lies.
    fn around(&self, (mcu, track, cycle): &End) -> &Slice {
        let slices = self.track(mcu, track).iter();
        let mut around = slices.filter(|slice| slice.begin <= *cycle && *cycle < slice.end);
        around.next().unwrap_or_else(|| panic!("nothing is on {mcu} {track} at {cycle}"))
    }

    fn track(&self, mcu: &str, track: &str) -> &[Slice] {
        let slices = self.tracks.get(&(mcu.into(), track.into()));
        slices.unwrap_or_else(|| panic!("{mcu} has no track {track}: {:?}", self.tracks.keys()))
    }

    /// The cycles of the outermost slices of a track for which `is_meant` holds by name.
    fn cycles(&self, mcu: &str, track: &str, is_meant: impl Fn(&str) -> bool) -> u64 {
        let slices = self.track(mcu, track).iter().filter(|slice| slice.depth == 0 && is_meant(&slice.name));
        slices.map(|slice| slice.end - slice.begin).sum()
    }
}

/// The fraction of an MCU's time in which it was awake, by its track of the CPU.
fn load(timeline: &Timeline, mcu: &str) -> f64 {
    let awake = timeline.cycles(mcu, "CPU", |name| !matches!(name, "sleep" | "reset"));
    awake as f64 / timeline.cycles(mcu, "CPU", |_| true) as f64
}

#[test]
fn a_trace_adds_up_to_the_summary_and_changes_nothing() {
    let robot = ["chain", "--modules", "2", "--seconds", "1", "--world", "none"];
    let all = "0.master,1.master,0.slave,1.slave";
    let (report, timeline) = traced("sums", &[&robot[..], &["--trace-of", all]].concat());
    for controller in ["master", "slave"] {
        let loads = [0, 1].map(|module| load(&timeline, &format!("{module}.{controller}")));
        let told = &report["cpu_load"][controller];
        let mean = told["mean"].as_f64().expect("it is told");
        assert!((loads[0] + loads[1] - 2.0 * mean).abs() < 1e-12, "{loads:?}, and {told}");
        assert!((loads[0].max(loads[1]) - told["max"].as_f64().expect("it is told")).abs() < 1e-12);
    }
    for mcu in all.split(',') {
        // Each task's own track agrees with that of the CPU.
        let tasks = timeline.tracks.keys().filter(|(of, track)| of == mcu && track != "CPU");
        let mut tasks_seen = 0;
        for (_, task) in tasks.filter(|(_, task)| task.chars().all(|one| !one.is_lowercase())) {
            let running = timeline.cycles(mcu, task, |name| name == "running");
            assert_eq!(running, timeline.cycles(mcu, "CPU", |name| name == task), "{mcu} {task}");
            tasks_seen += 1;
        }
        assert!(tasks_seen >= 9, "{mcu} has {tasks_seen} tasks");
        // The track reaches the end of the run, to within an instruction.
        let cpu = timeline.track(mcu, "CPU");
        let end = cpu.iter().map(|slice| slice.end).max().expect("something was");
        assert!((16_000_000..16_000_010).contains(&end), "{end}");
        assert!(cpu.iter().any(|slice| slice.depth == 1), "interrupts lie within what they interrupt");
    }
    let without = run(&[&["sim"], &robot[..], &["--json", "-"]].concat());
    let without: Value = serde_json::from_slice(&without.stdout).expect("it tells");
    assert_eq!(report["state_hash"], without["state_hash"]);
}

/// A module's reset, and another one's loss of power, in the middle of a run.
const CHANGES: &str = r#"
shape = "chain"
modules = 3

[[event]]
at = 0.4
reset = 0

[[event]]
at = 0.5
kill = 2
"#;

#[test]
fn resets_and_deaths_keep_a_trace_right() {
    let robot = file("changes.toml");
    std::fs::write(&robot, CHANGES).expect("it can be written");
    let robot_text = robot.to_str().expect("the path is text");
    let arguments =
        [robot_text, "--seconds", "1", "--world", "none", "--trace-of", "0.master,1.slave,2.master"];
    let (_, timeline) = traced("changes", &arguments);
    std::fs::remove_file(&robot).expect("it can be removed");
    let end = |mcu: &str| timeline.track(mcu, "CPU").iter().map(|slice| slice.end).max().expect("it ran");
    assert!((16_000_000..16_000_010).contains(&end("0.master")));
    assert!((16_000_000..16_000_010).contains(&end("1.slave")));
    // The MCU that lost its power stops then, with all of its tracks.
    assert!((8_000_000..8_000_010).contains(&end("2.master")));
    for ((mcu, track), slices) in &timeline.tracks {
        assert!(slices.iter().all(|slice| slice.end <= end(mcu)), "{mcu} {track}");
    }
    let reset: Vec<_> =
        timeline.track("0.master", "CPU").iter().filter(|slice| slice.name == "reset").collect();
    assert!(matches!(reset[..], [only] if only.begin.abs_diff(6_400_000) < 10), "{reset:?}");
    for (_, track) in timeline.tracks.keys().filter(|(mcu, _)| mcu == "0.master") {
        let overlaps = |slice: &&Slice| slice.begin < reset[0].end && slice.end > reset[0].begin;
        let during: Vec<_> = timeline.track("0.master", track).iter().filter(overlaps).collect();
        let may_be = track == "CPU" || track.ends_with("hears") || track.ends_with("sends");
        assert!(may_be || during.is_empty(), "{track}: {during:?}");
    }
    let hormone = timeline.track("0.master", "HORMONE");
    assert!(hormone.iter().any(|slice| slice.name == "running" && slice.begin > reset[0].end));
}

#[test]
fn arrows_lead_from_dock_to_dock_and_from_hormone_to_hormone() {
    let robot = ["chain", "--modules", "3", "--seconds", "2", "--world", "none"];
    let all = "0.master,0.slave,1.master,1.slave,2.master";
    let (report, timeline) = traced("flows", &[&robot[..], &["--trace-of", all]].concat());
    let (mut frames, mut hormones) = (0, 0);
    for (name, ends) in timeline.flows.values() {
        let [from, to] = [&ends[0], &ends[1]].map(|end| (&end.0, &end.1, timeline.around(end)));
        assert!(ends[0].2 <= ends[1].2, "{name} arrives after it was sent");
        if name.starts_with("hormone") {
            assert_eq!((from.1.as_str(), to.1.as_str()), ("HORMONE", "HORMONE"));
            assert_eq!((from.2.name.as_str(), to.2.name.as_str()), ("running", "running"));
            hormones += 1;
        } else {
            assert_eq!((&from.2.name, from.2.begin), (name, ends[0].2));
            assert_eq!((&to.2.name, to.2.begin), (name, ends[1].2));
            let docks = (from.0.as_str(), from.1.as_str(), to.0.as_str(), to.1.as_str());
            let is_attached = matches!(
                docks,
                ("0.slave", "Back sends", "1.master", "Front hears")
                    | ("1.master", "Front sends", "0.slave", "Back hears")
                    | ("1.slave", "Back sends", "2.master", "Front hears")
                    | ("2.master", "Front sends", "1.slave", "Back hears")
            );
            assert!(is_attached, "{docks:?}");
            frames += 1;
        }
    }
    assert_eq!(report["hormones_delivered"], hormones, "each hormone that came has an arrow");
    // No frame is lost: each frame that those docks sent has an arrow, except one under way at the end.
    let sent = [("0.slave", "Back sends"), ("1.master", "Front sends"), ("1.slave", "Back sends")];
    let sent = sent.into_iter().chain([("2.master", "Front sends")]);
    let sent: usize = sent.map(|(mcu, track)| timeline.track(mcu, track).len()).sum();
    assert!(frames > 50 && (frames..=frames + 4).contains(&sent), "{frames} of {sent} frames");
}

/// Light of both docks comes at both, and later; a frame that nothing overlaps has an arrow all the same.
#[test]
fn arrows_lead_from_dock_to_dock_where_these_share_one_light() {
    let robot = file("shared-light.toml");
    let text = "shape = \"chain\"\nmodules = 2\n[[event]]\nat = 0\nshared_light = true\n";
    std::fs::write(&robot, text).expect("it can be written");
    let path = robot.to_str().expect("the path is text");
    let options = ["--seconds", "2", "--world", "none", "--trace-of", "0.slave,1.master"];
    let (_, timeline) = traced("shared-light", &[&[path], &options[..]].concat());
    std::fs::remove_file(&robot).expect("it can be removed");
    let sent = [("0.slave", "Back sends"), ("1.master", "Front sends")];
    let sent: usize = sent.map(|(mcu, track)| timeline.track(mcu, track).len()).into_iter().sum();
    let frames = timeline.flows.len();
    assert!(frames > 50 && (frames..=frames + frames / 10).contains(&sent), "{frames} of {sent} frames");
}

#[test]
fn joints_are_controlled_each_millisecond() {
    let (_, timeline) = traced("joints", &["chain", "--modules", "2", "--seconds", "2", "--world", "none"]);
    let control = timeline.track("0.master", "joints");
    assert!(control.len() > 100 && control.iter().all(|slice| slice.name == "control"));
    // Only while a joint moves. The probe's shortest pulse puts the last drives into effect, and then the
    // joint rests for long.
    let follows =
        |pair: &&[Slice]| pair[1].begin - pair[0].begin < 32_000 && pair[1].end - pair[1].begin > 200;
    let apart: Vec<u64> =
        control.windows(2).filter(follows).map(|pair| pair[1].begin - pair[0].begin).collect();
    assert!(apart.len() > 100 && apart.iter().all(|apart| apart.abs_diff(16_000) < 20 * 16), "{apart:?}");
    // The task with the highest priority has the CPU for most of it.
    let running = timeline.track("0.master", "MOTORS");
    for slice in control {
        let inside = running.iter().filter(|other| other.name == "running");
        assert!(inside.clone().any(|other| other.begin < slice.end && slice.begin < other.end), "{slice:?}");
    }
}

#[test]
fn simavrs_own_interpreter_leaves_the_same_trace() {
    let robot = ["chain", "--modules", "1", "--seconds", "0.3", "--world", "none"];
    let slices = |core: &str| {
        let (_, timeline) = traced(core, &[&robot[..], &["--core", core]].concat());
        format!("{:?}", timeline.tracks)
    };
    assert!(slices("decoded") == slices("simavr"), "the traces differ");
}

#[test]
fn what_cannot_be_traced_is_refused() {
    let path = file("refused");
    let path = path.to_str().expect("the path is text");
    let json = file("refused-json");
    let json = json.to_str().expect("the path is text");
    for (arguments, advice) in [
        (&["--trace", path, "--trace-of", "0.leader"][..], "0.master or 3.slave"),
        (&["--trace", path, "--trace-of", ""], "0.master or 3.slave"),
        (&["--trace", path, "--trace-of", "2.master"], "modules are 0 to 1"),
        (&["--trace", path, "--trace-of", "1.slave,1.slave"], "1.slave twice"),
        (&["--trace", path, "--trace-of", "0.master,1.slave", "--seconds", "201"], "200 s at most"),
        (
            &["--trace", path, "--trace-of", "0.master,1.slave,1.master", "--seconds", "134"],
            "133.333 s at most",
        ),
        (&["--trace-of", "1.slave"], "--trace"),
        (&["--trace", "-"], "give --trace a file"),
        (&["--trace", "/nowhere/at/all"], "give --trace another path"),
        (&["--trace", json, "--json", json], "another option already writes"),
        (&["--trace", path, "--engine", "host"], "--engine simavr"),
    ] {
        let output = run(&[&["sim", "chain", "--modules", "2"], arguments].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(advice), "{arguments:?}: {message}");
        assert!(!Path::new(path).exists());
    }
}
