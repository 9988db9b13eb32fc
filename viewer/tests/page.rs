//! A page holds the recorded data, as exactly as its units allow.

use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::DeflateDecoder;
use hormone::gait::GaitName;
use serde_json::Value;
use simulation::{Change, Event, Face, Links, Loss, MILLISECOND, Native, Recording, Run, Shape};
use tasks::dock::Dock;
use viewer::{Ground, Subject, live_page, message, page};

fn recording() -> Recording {
    let robot = Native::new(Shape::Centipede.wiring(10).unwrap(), 1, 40 * MILLISECOND);
    let loss = Change::Loss { links: Links::All, probability: 0.2 };
    let timeline = vec![
        Event { at: 500 * MILLISECOND, change: loss },
        Event { at: 2_500 * MILLISECOND, change: Change::Kill(3) },
        Event { at: 3_000 * MILLISECOND, change: Change::Detach(Face { module: 1, dock: Dock::Right }) },
    ];
    let mut run = Run::new(robot, timeline, u64::from(GaitName::Centipede.gait().period()) * MILLISECOND);
    run.record(40 * MILLISECOND);
    while run.step(4_000 * MILLISECOND).unwrap() {}
    let mut recording = run.finish_recording().unwrap();
    let loss = |look, module| Loss { look, from: Face { module, dock: Dock::Back }, frames: 200 };
    recording.losses = Some(vec![loss(3, 1), loss(99, 4)]);
    recording
}

fn subject() -> Subject {
    Subject {
        robot: "</script><!--".into(),
        engine: "host".into(),
        seconds: 4.0,
        seed: 1,
        ground: Some(Ground { slope: 10.0, ..Ground::default() }),
        summary: "10 modules".into(),
        faults: Vec::new(),
    }
}

/// The content of the element of this name.
fn element<'a>(page: &'a str, name: &str) -> &'a str {
    let (_, rest) = page.split_once(&format!("id=\"{name}\">")).unwrap();
    rest.split_once("</script>").unwrap().0
}

/// The numbers in the page's bytes.
fn numbers(page: &str) -> Vec<u64> {
    let mut bytes = Vec::new();
    let compressed = STANDARD.decode(element(page, "recording")).unwrap();
    DeflateDecoder::new(&compressed[..]).read_to_end(&mut bytes).unwrap();
    let mut numbers = Vec::new();
    let (mut number, mut shift) = (0, 0);
    for byte in bytes {
        number |= u64::from(byte & 0x7F) << shift;
        shift += 7;
        if byte < 0x80 {
            numbers.push(std::mem::take(&mut number));
            shift = 0;
        }
    }
    assert_eq!(shift, 0, "the last number is whole");
    numbers
}

#[test]
fn all_that_was_recorded_is_in_the_page() {
    let recording = recording();
    let mut numbers = numbers(&page(&subject(), &recording).unwrap()).into_iter();
    let mut next = || numbers.next().unwrap();
    let looks = recording.placings.len() / 10;
    for module in 0..10 {
        let mut rows = [[0; 10]; 101];
        for number in 0..10 {
            let mut value = 0;
            for row in &mut rows[..looks] {
                let zigzag = next();
                value += (zigzag >> 1) as i64 ^ -((zigzag & 1) as i64);
                row[number] = value;
            }
        }
        for (row, placing) in rows.iter().zip(recording.placings.iter().skip(module).step_by(10)) {
            let place = placing.frame.translation.to_array();
            for axis in 0..3 {
                assert!((row[axis] as f64 * 0.5 - place[axis]).abs() <= 0.25);
                assert!((row[7 + axis] as f64 * 0.2 - placing.angles[axis]).abs() <= 0.1 + 1e-9);
            }
            let turn = glam::DQuat::from_mat3(&placing.frame.matrix3);
            let [x, y, z, w] = [3, 4, 5, 6].map(|part| row[part] as f64 / 2048.0);
            let degrees = glam::DQuat::from_xyzw(x, y, z, w).normalize().dot(turn).abs().min(1.0).acos();
            assert!(degrees.to_degrees() < 0.1, "{degrees}");
        }
    }
    let microseconds = |cycles: u64| cycles / 16;
    let face = |Face { module, dock }: Face| module as u64 * 6 + u64::from(dock.index());
    assert_eq!(next(), recording.hormones.len() as u64);
    let (mut now, mut lost) = (0, 0);
    for passage in &recording.hormones {
        now += next();
        assert_eq!(now, microseconds(passage.sent));
        assert_eq!([next(), next()], [face(passage.from), passage.data as u64]);
        let took = next();
        lost += u64::from(took == 0);
        assert_eq!(took, passage.arrived.map_or(0, |arrived| microseconds(arrived) - now + 1));
    }
    assert!(lost > 0);
    assert_eq!(next(), recording.trace_events.len() as u64);
    now = 0;
    for trace_event in &recording.trace_events {
        now += next();
        assert_eq!(now, microseconds(trace_event.cycle));
        assert_eq!([next(), next()], [trace_event.module as u64, u64::from(trace_event.event.to_byte())]);
    }
    assert_eq!(next(), recording.views.len() as u64);
    now = 0;
    for view in &recording.views {
        now += next();
        assert_eq!([now, next()], [view.look as u64, view.module as u64]);
        let docks = next();
        assert!(Dock::ALL.iter().all(|dock| (docks >> dock.index() & 1 == 1) == view.docks.contains(*dock)));
        assert_eq!(next(), view.module_type.map_or(0, |it| it as u64 + 1));
    }
    let losses: Vec<u64> = numbers.collect();
    assert_eq!(losses, [2, 3, 7, 200, 96, 25, 200]);
}

#[test]
fn what_is_said_of_the_run_can_be_read_and_ends_nothing() {
    let recording = recording();
    let page = page(&subject(), &recording).unwrap();
    let about = element(&page, "about");
    assert!(!about.contains('<'));
    let about: Value = serde_json::from_str(about).unwrap();
    assert_eq!(about["robot"], "</script><!--");
    let part: Value = serde_json::from_str(element(&page, "part")).unwrap();
    assert_eq!(
        [&about["modules"], &part["looks"], &about["every"]].map(Value::as_f64),
        [10.0, 101.0, 0.04].map(Some)
    );
    assert_eq!(about["ground"]["slope"], 10.0);
    assert_eq!(part["counts_losses"], true);
    assert_eq!([&about["types"][0], &about["types"][7]], ["Head", "Alone"]);
    assert_eq!(about["codes"]["18"], serde_json::json!(["type", "LeftLeg"]));
    assert_eq!(about["gaits"]["4"], "RollingTrack");
    assert_eq!(about["codes"]["49"], serde_json::json!(["action", "Swing"]));
    assert_eq!(part["happenings"][1], serde_json::json!([2.5, "the power of module 3 fails"]));
    let wirings = part["wirings"].as_array().unwrap();
    let pairs: Vec<usize> = wirings.iter().map(|wiring| wiring["pairs"].as_array().unwrap().len()).collect();
    assert_eq!(pairs, [9, 9, 8], "a module without power is attached until a neighbour lets go of it");
}

#[test]
fn the_page_fetches_nothing() {
    let page = page(&subject(), &recording()).unwrap();
    assert!(
        page.contains(
            "content=\"default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
        )
    );
    for fetched in ["src=\"http", "href=\"http", "@import", "url(http"] {
        assert!(!page.contains(fetched), "{fetched}");
    }
}

#[test]
fn the_page_of_a_run_that_goes_on_asks_who_served_it_and_nobody_else() {
    let page = live_page(&subject(), 10, 40 * MILLISECOND).unwrap();
    assert!(page.contains("img-src data: blob:; connect-src 'self'\""));
    let about: Value = serde_json::from_str(element(&page, "about")).unwrap();
    assert_eq!([&about["modules"], &about["every"]].map(Value::as_f64), [10.0, 0.04].map(Some));
    assert!(!page.contains("id=\"recording\""), "nothing has come of it yet");
}

#[test]
fn a_message_says_how_long_its_parts_are() {
    assert_eq!(message(&[1], &[7, 8]).unwrap(), b"\x03\0\0\0\x02\0\0\0[1]\x07\x08");
    let news = viewer::news(&recording()).unwrap();
    let [json, bytes] = [0, 4].map(|at| u32::from_le_bytes(news[at..at + 4].try_into().unwrap()) as usize);
    assert_eq!(8 + json + bytes, news.len());
    let part: Value = serde_json::from_slice(&news[8..8 + json]).unwrap();
    assert_eq!(part["looks"], 101);
}

#[test]
fn the_licence_of_what_is_in_the_page_is_in_the_page() {
    let page = page(&subject(), &recording()).unwrap();
    assert!(page.contains("three.js authors") && page.contains("THE SOFTWARE IS PROVIDED \"AS IS\""));
}
