//! Tests `./x sim --trace FILE.vcd`: reads the levels as an instrument at the pins would see them, and
//! compares them with the timeline of the same run.

mod command;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use command::run;
use serde_json::Value;
use vcd::{Command, IdCode, Parser, ScopeItem, Value as Level};

/// Units of time of the file, 100 ps, in a cycle.
const CYCLE: u64 = 625;

/// Cycles of a bit at 38400 baud.
const BIT: u64 = 416;

/// The options of the traced run.
const ROBOT: [&str; 8] =
    ["sim", "chain", "--modules", "2", "--seconds", "1", "--trace-of", "0.master,0.slave,1.master"];

fn trace(name: &str) -> (Value, PathBuf) {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{name}", std::process::id()));
    let path_text = path.to_str().expect("the path is text");
    let output = run(&[&ROBOT[..], &["--world", "none", "--json", "-", "--trace", path_text]].concat());
    let error = String::from_utf8_lossy(&output.stderr);
    (serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{error}")), path)
}

/// Wires by scope and name: the level from each cycle on, the first at power-up.
struct Wires {
    wires: BTreeMap<(String, String), Vec<(u64, bool)>>,
    end: u64,
}

impl Wires {
    fn read(path: &Path) -> Self {
        let mut parser = Parser::new(BufReader::new(File::open(path).expect("it was written")));
        let header = parser.parse_header().expect("it has a header");
        let mut names: BTreeMap<IdCode, (String, String)> = BTreeMap::new();
        for scope in header.items.iter() {
            let ScopeItem::Scope(scope) = scope else { continue };
            for item in scope.items.iter() {
                let ScopeItem::Var(wire) = item else { continue };
                names.insert(wire.code, (scope.identifier.clone(), wire.reference.clone()));
            }
        }
        let (mut wires, mut end) = (BTreeMap::new(), 0);
        for command in parser {
            match command.expect("it can be read") {
                Command::Timestamp(time) => {
                    assert_eq!(time % CYCLE, 0, "between two cycles");
                    assert!(time == 0 || time > end * CYCLE, "times rise");
                    end = time / CYCLE;
                }
                Command::ChangeScalar(id, level) => {
                    let levels: &mut Vec<(u64, bool)> = wires.entry(names[&id].clone()).or_default();
                    assert_ne!(
                        levels.last().map(|last| last.1),
                        Some(level == Level::V1),
                        "an edge changes it"
                    );
                    levels.push((end, level == Level::V1));
                }
                _ => {}
            }
        }
        Wires { wires, end }
    }

    fn wire(&self, scope: &str, name: &str) -> &[(u64, bool)] {
        let wire = self.wires.get(&(scope.into(), name.into()));
        wire.unwrap_or_else(|| panic!("no {name} at {scope}: {:?}", self.wires.keys()))
    }
}

fn level_at(wire: &[(u64, bool)], cycle: u64) -> bool {
    wire[wire.partition_point(|&(since, _)| since <= cycle) - 1].1
}

/// The characters that a USART receives until `end`, which may cut the last character off.
fn characters(wire: &[(u64, bool)], end: u64) -> Vec<u8> {
    let mut characters = Vec::new();
    let mut deaf_until = 0;
    for &(start, level) in wire {
        if level || start < deaf_until {
            continue;
        }
        if start + 10 * BIT > end {
            break;
        }
        let bit = |number: u64| level_at(wire, start + number * BIT + BIT / 2);
        assert!(!bit(0) && bit(9), "start and stop at {start}");
        characters.push((0..8).fold(0, |value, number| value | u8::from(bit(number + 1)) << number));
        deaf_until = start + 9 * BIT + BIT / 2;
    }
    characters
}

/// A transaction on a two-wire bus: bytes, each with whether it was acknowledged.
type Transaction = Vec<(u8, bool)>;

/// Decodes the transactions from the levels of both wires.
fn transactions(clock: &[(u64, bool)], data: &[(u64, bool)]) -> Vec<Transaction> {
    let mut edges: Vec<(u64, bool, bool)> =
        clock.iter().map(|&(cycle, level)| (cycle, true, level)).collect();
    edges.extend(data.iter().map(|&(cycle, level)| (cycle, false, level)));
    edges.sort_unstable();
    let mut all: Vec<Transaction> = Vec::new();
    let mut bits: Option<Vec<bool>> = None;
    for (cycle, is_clock, level) in edges.into_iter().filter(|edge| edge.0 > 0) {
        if is_clock {
            if let Some(bits) = bits.as_mut().filter(|_| level) {
                bits.push(level_at(data, cycle));
            }
        } else if level_at(clock, cycle) {
            // SDA changes while SCL is high: a START or a STOP. SCL has risen once for it.
            if let Some(bits) = bits.take() {
                assert_eq!(bits.len() % 9, 1, "{} bits before {cycle}", bits.len());
                let byte = |bits: &[bool]| bits[..8].iter().fold(0, |byte, &bit| byte << 1 | u8::from(bit));
                all.push(bits.chunks_exact(9).map(|bits| (byte(bits), !bits[8])).collect());
            }
            bits = (!level).then(Vec::new);
        }
    }
    all
}

#[test]
fn levels_say_what_the_timeline_says() {
    let (report, vcd) = trace("levels.vcd");
    let (_, json) = trace("levels.json");
    let wires = Wires::read(&vcd);
    let timeline: Value =
        serde_json::from_slice(&std::fs::read(&json).expect("it was written")).expect("JSON");
    let events = timeline["traceEvents"].as_array().expect("there are events");
    for file in [vcd, json] {
        std::fs::remove_file(file).expect("it can be removed");
    }
    assert!((16_000_000..16_000_010).contains(&wires.end), "{}", wires.end);
    let named = |kind: &str, name: &str, pid: Option<&Value>| {
        let mut found = events.iter().filter(|event| {
            event["name"] == kind
                && event["args"]["name"] == name
                && pid.is_none_or(|pid| event["pid"] == *pid)
        });
        found.next().unwrap_or_else(|| panic!("no {name}"))
    };
    let begun = |mcu: &str, track: &str| {
        let pid = &named("process_name", mcu, None)["pid"];
        let tid = named("thread_name", track, Some(pid))["tid"].clone();
        events.iter().filter(move |event| event["ph"] == "B" && event["tid"] == tid)
    };

    // The bytes of the frames on each dock's line, by a USART or in software.
    for (mcu, dock) in
        [("0.master", "Front"), ("0.master", "Left"), ("0.master", "Right"), ("0.slave", "Back")]
    {
        for verb in ["sends", "hears"] {
            if verb == "hears" && dock != "Back" {
                continue; // nothing is attached there
            }
            let told = begun(mcu, &format!("{dock} {verb}"));
            let told =
                told.flat_map(|event| event["args"]["bytes"].as_str().expect("they are told").split(' '));
            let told: Vec<u8> = told.map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal")).collect();
            let heard = characters(wires.wire(&mcu.replace('.', "_"), &format!("{dock}_{verb}")), wires.end);
            assert!(
                heard.len() > 20 && told.len() - heard.len() < 10,
                "{mcu} {dock} {verb}: {}",
                heard.len()
            );
            assert_eq!(told[..heard.len()], heard, "{mcu} {dock} {verb}");
        }
    }

    // On the bus, messages from either MCU to the other.
    let all = transactions(wires.wire("0_bus", "SCL"), wires.wire("0_bus", "SDA"));
    let messages = report["bridge"]["messages"].as_u64().expect("they are counted");
    assert!(all.len() > 20 && messages > 20, "{} transactions, {messages} messages", all.len());
    let mut unheard = 0_u64;
    let heard = all.iter().map(|bytes| {
        let &(address, is_acknowledged) = bytes.first().expect("an address comes first");
        assert!(matches!(address >> 1, 0x10 | 0x11), "{bytes:02x?}");
        unheard += u64::from(!is_acknowledged);
        let way = match address & 1 {
            _ if !is_acknowledged => "nobody at",
            0 => "write to",
            _ => "read from",
        };
        let data: Vec<String> = bytes[1..].iter().map(|(byte, _)| format!("{byte:02x}")).collect();
        (format!("{way} {:#04x}", address >> 1), data.join(" "))
    });
    let told = begun("0.master", "two-wire bus").map(|event| {
        let text = |value: &Value| value.as_str().expect("it is text").to_owned();
        (text(&event["name"]), text(&event["args"]["bytes"]))
    });
    let (heard, told): (Vec<_>, Vec<_>) = (heard.collect(), told.collect());
    // Sometimes an MCU still handles the packet before and does not answer the next one, which is sent again.
    let retries = report["bridge"]["retries"].as_u64().expect("they are counted");
    assert!(unheard <= retries, "{unheard} found nobody, {retries} were sent again");
    assert!(unheard * 50 < heard.len() as u64, "{unheard} of {} found nobody", heard.len());
    assert!(told.starts_with(&heard) && told.len() <= heard.len() + 1, "{} of {}", heard.len(), told.len());

    // The joints' control begins at the same cycles as on the timeline.
    let begins: Vec<u64> = begun("0.master", "joints")
        .map(|event| (event["ts"].as_f64().expect("a time") * 16.0) as u64)
        .collect();
    let control = wires.wire("0_master", "control");
    let rises: Vec<u64> = control.iter().filter(|edge| edge.1).map(|edge| edge.0).collect();
    assert!(!begins.is_empty());
    assert_eq!(begins, rises);

    // The pulses for a joint come 20,000 times a second, each centred on the same point of its period.
    let pulses: Vec<&[(u64, bool)]> = wires.wire("0_master", "Front_pwm")[1..].chunks_exact(2).collect();
    assert!(pulses.len() > 100, "{} pulses", pulses.len());
    let middles: Vec<u64> = pulses.iter().map(|pulse| (pulse[0].0 + pulse[1].0) / 2).collect();
    let reference = middles[1];
    // The first pulse begins in its middle, when the timer starts.
    let off = |&middle: &u64| {
        let off = (middle - reference) % 800;
        off.min(800 - off)
    };
    let middles = &middles[1..];
    let exact = middles.iter().filter(|middle| off(middle) <= 1).count();
    assert!(exact * 10 > middles.len() * 9, "{exact} of {} pulses", middles.len());
    assert!(pulses.iter().all(|pulse| pulse[0].1 && !pulse[1].1));
    // At full drive there is no pause between pulses, for whole periods of the control. That is rare.
    let (pulses, full): (Vec<u64>, Vec<u64>) =
        pulses.iter().map(|pulse| pulse[1].0 - pulse[0].0).partition(|&cycles| cycles <= 800);
    assert!(full.iter().all(|cycles| cycles % 16_000 <= 800), "{full:?}");
    assert!(full.len() * 1_000 < pulses.len(), "{} of {} pulses", full.len(), pulses.len());
}

#[test]
fn whatever_comes_before_the_end_of_its_name_a_file_has_levels() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-names", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    for name in [".vcd", "run.VCD"] {
        let path = folder.join(name);
        let path_text = path.to_str().expect("the path is text");
        let chain = ["sim", "chain", "--modules", "1", "--seconds", "0.1", "--world", "none"];
        let output = run(&[&chain[..], &["--json", "-", "--trace", path_text]].concat());
        let written = std::fs::read_to_string(&path).unwrap_or_else(|_| panic!("{output:?}"));
        assert!(written.starts_with('$'), "{name}: {}", &written[..20]);
    }
    std::fs::remove_dir_all(folder).expect("it was made");
}
