//! Tests a run that pages show: which pages may, and what they change.

mod command;

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::os::unix::ffi::OsStrExt;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use serde_json::Value;

/// A run, and the address of its page.
struct Viewed {
    program: Child,
    host: String,
    token: String,
}

impl Viewed {
    fn start(arguments: &[impl AsRef<OsStr>]) -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_superbot-sim"));
        program.args(arguments).arg("--view").env("SUPERBOT_IMAGES", command::images());
        program.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        let mut program = program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(program.stderr.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("superbot-sim: look at http://").expect(&line);
        let (host, token) = address.trim_end_matches('/').split_once('/').unwrap();
        Viewed { host: host.into(), token: token.into(), program }
    }

    /// The answer to a request with these headers, which closes the connection.
    fn send(&self, what: &str, headers: &str, body: &str) -> String {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        let length = body.len();
        let request = format!(
            "{what} HTTP/1.1\r\n{headers}Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    fn ask(&self, wish: &str) -> String {
        self.ask_by("", wish)
    }

    fn ask_by(&self, query: &str, wish: &str) -> String {
        let Viewed { host, token, .. } = self;
        let headers = format!("Host: {host}\r\nOrigin: http://{host}\r\n");
        self.send(&format!("POST /{token}/ask{query}"), &headers, wish)
    }

    /// Listens as a page does. Returns the stream, and the query with which this page makes its wishes.
    fn listen(&self) -> (BufReader<TcpStream>, String) {
        let Viewed { host, token, .. } = self;
        let mut stream = TcpStream::connect(host).unwrap();
        stream
            .write_all(format!("GET /{token}/live?had=0 HTTP/1.1\r\nHost: {host}\r\n\r\n").as_bytes())
            .unwrap();
        let mut stream = BufReader::new(stream);
        let mut line = String::new();
        while !line.starts_with("Stream: ") {
            line.clear();
            assert_ne!(stream.read_line(&mut line).unwrap(), 0, "it has no number");
        }
        (stream, line.trim().replace("Stream: ", "?stream="))
    }

    /// The time that the run has reached, in seconds. Makes an event happen that changes nothing, and reads
    /// its time from the timeline.
    fn now(&self) -> f64 {
        assert!(self.ask(r#"{"event": "loss = 0"}"#).starts_with("HTTP/1.1 200"));
        let timeline = self.ask(r#"{"timeline": null}"#);
        // Events of the robot file that are still to come stand behind it.
        let (until_then, _) = timeline.rsplit_once("\nloss = ").unwrap();
        until_then.rsplit_once("at = ").unwrap().1.parse().unwrap()
    }

    /// Waits for some time until the run advances, or until it stands if `goes_on` is false. Returns whether
    /// it does.
    fn comes_to(&self, goes_on: bool) -> bool {
        (0..50).any(|_| {
            let before = self.now();
            thread::sleep(Duration::from_millis(200));
            (self.now() > before) == goes_on
        })
    }

    /// The report of the run, once it is over.
    fn report(mut self) -> Value {
        let mut json = String::new();
        self.program.stdout.take().unwrap().read_to_string(&mut json).unwrap();
        self.program.wait().unwrap();
        report(&json)
    }
}

impl Drop for Viewed {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// The texts of all messages that a page gets until the run is over.
fn messages(stream: &mut BufReader<TcpStream>) -> Vec<Value> {
    let mut line = String::new();
    while line != "\r\n" {
        line.clear();
        stream.read_line(&mut line).unwrap();
    }
    let mut messages: Vec<Value> = Vec::new();
    while messages.last().is_none_or(|said| said.get("ended").is_none()) {
        let mut length = || {
            let mut bytes = [0; 4];
            stream.read_exact(&mut bytes).unwrap();
            u32::from_le_bytes(bytes) as usize
        };
        let (words, rest) = (length(), length());
        let mut bytes = vec![0; words + rest];
        stream.read_exact(&mut bytes).unwrap();
        // A message without text is skipped.
        messages.extend(serde_json::from_slice(&bytes[..words]));
    }
    messages
}

/// A report without the fields that differ from run to run.
fn report(json: &str) -> Value {
    let mut report: Value = serde_json::from_str(json).unwrap();
    for field in ["wall_seconds", "wall_ratio", "cost"] {
        report[field].take();
    }
    report
}

#[test]
fn a_run_that_is_looked_at_is_the_same_run() {
    let robots = [
        &["chain", "--seconds", "0.5"][..],
        &["chain", "--world", "none", "--seconds", "0.5"],
        &["centipede", "--engine", "host", "--seconds", "2.1"],
    ];
    for robot in robots {
        let arguments = [&["sim", "--loss", "0.1", "--json", "-"], robot].concat();
        let viewed = Viewed::start(&arguments);
        for until in ["0.13", "0.2", "9"] {
            assert!(viewed.ask(&format!("{{\"until\": {until}}}")).starts_with("HTTP/1.1 200"));
        }
        let alone = command::run(&arguments);
        assert_eq!(viewed.report(), report(&String::from_utf8(alone.stdout).unwrap()), "{robot:?}");
    }
}

#[test]
fn a_robot_that_comes_through_a_pipe_is_read_once() {
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("robot.toml");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let writer = pipe.clone();
    thread::spawn(move || {
        for robot in ["shape = \"chain\"\nmodules = 3\n", "this is no robot"] {
            std::fs::write(&writer, robot).unwrap();
            thread::sleep(Duration::from_secs(1)); // so that who reads finds the end
        }
    });
    let viewed = Viewed::start(&["sim".as_ref(), pipe.as_os_str(), "--engine".as_ref(), "host".as_ref()]);
    let timeline = viewed.ask(r#"{"timeline": null}"#);
    assert!(timeline.contains("shape = \"chain\"\nmodules = 3\n"), "{timeline}");
}

#[test]
fn only_who_has_the_token_is_answered_and_no_other_origin() {
    let viewed = Viewed::start(&["sim", "chain", "--engine", "host"]);
    let Viewed { host, token, .. } = &viewed;
    assert!(host.starts_with("127.0.0.1:"), "{host}");
    let page = format!("GET /{token}/");
    let status = |what: &str, headers: &str| {
        let answer = viewed.send(what, headers, "");
        answer.split(' ').nth(1).unwrap_or_default().to_owned()
    };
    let own = format!("Host: {host}\r\n");
    let local = own.replace("127.0.0.1", "localhost");
    assert_eq!([status(&page, &own), status(&page, &local)], ["200", "200"]);
    assert_eq!(status("GET /", &own), "404");
    assert_eq!(status(&format!("GET /{}/", "0".repeat(32)), &own), "404");
    for foreign in ["Host: superbot.example\r\n", "Host: 127.0.0.1\r\n", ""] {
        assert_eq!(status(&page, foreign), "403", "{foreign}");
    }
    for origin in ["http://superbot.example", "null", "http://127.0.0.1:1"] {
        assert_eq!(status(&page, &format!("{own}Origin: {origin}\r\n")), "403", "{origin}");
    }
}

#[test]
fn a_request_that_does_not_come_to_its_end_keeps_nobody_waiting() {
    let viewed = Viewed::start(&["sim", "chain", "--engine", "host"]);
    let Viewed { host, token, .. } = &viewed;
    let silent = ["", &format!("{token}/ask")].map(|path| {
        let mut stream = TcpStream::connect(host).unwrap();
        let request = format!("POST /{path} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 5000\r\n\r\n{{");
        stream.write_all(request.as_bytes()).unwrap();
        stream
    });
    thread::sleep(Duration::from_millis(200));
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let request = format!("GET /{token}/ HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line).expect("it is answered");
    assert!(line.starts_with("HTTP/1.1 200"), "{line}");
    drop(silent);
}

#[test]
fn a_request_that_says_it_is_huge_or_is_none_does_not_end_the_run() {
    let viewed = Viewed::start(&["sim", "chain", "--engine", "host"]);
    let Viewed { host, token, .. } = &viewed;
    let endless = "x".repeat(1_000_000);
    for request in [
        "POST / HTTP/1.1\r\nContent-Length: 9223372036854775807\r\n\r\n{}",
        "POST / HTTP/1.1\r\nContent-Length: 18446744073709551615\r\n\r\n{}",
        "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n",
        "POST / HTTP/1.1\r\nno field\r\n\r\n",
        "GET\r\n\r\n",
        "\r\n\r\n",
        &format!("GET /{endless}"),
        &format!("POST /{token}/ask HTTP/1.1\r\nHost: {host}\r\nContent-Length: 1000000\r\n\r\n{endless}"),
    ] {
        let mut stream = TcpStream::connect(host).unwrap();
        // The program may leave before all of it is written.
        let _ = stream.write_all(request.as_bytes());
        let _ = stream.shutdown(Shutdown::Write);
        let _ = stream.read_to_end(&mut Vec::new());
        assert!(viewed.ask(r#"{"until": 0}"#).starts_with("HTTP/1.1 200"), "{request:.60}");
    }
}

#[test]
fn more_clients_than_the_system_has_room_for_do_not_end_the_run() {
    let viewed = Viewed::start(&["sim", "chain", "--engine", "host"]);
    let limit = ["--pid", &viewed.program.id().to_string(), "--nofile=40"];
    let limited = Command::new("prlimit").args(limit).status(); // of the essential package util-linux
    assert!(limited.unwrap().success());
    let clients: Vec<_> = (0..60).map(|_| TcpStream::connect(&viewed.host)).collect();
    thread::sleep(Duration::from_millis(200));
    drop(clients);
    assert!(viewed.ask(r#"{"until": 0}"#).starts_with("HTTP/1.1 200"));
}

#[test]
fn it_goes_on_for_as_long_as_any_page_wants_it_to_that_is_still_there() {
    let viewed = Viewed::start(&["sim", "--engine", "host", "--modules", "1000", "--seconds", "100"]);
    let ((plays, its_query), (_pauses, other_query)) = (viewed.listen(), viewed.listen());
    assert!(viewed.ask_by(&its_query, r#"{"until": 99}"#).starts_with("HTTP/1.1 200"));
    assert!(viewed.ask_by(&other_query, r#"{"until": 0}"#).starts_with("HTTP/1.1 200"));
    assert!(viewed.comes_to(true), "the page that pauses has stopped it");
    drop(plays);
    assert!(viewed.comes_to(false), "it goes on for a page that has gone");
    assert!(viewed.now() < 99.0);
}

#[test]
fn each_page_is_told_of_the_module_that_it_looks_into() {
    let viewed = Viewed::start(&["sim", "chain", "--engine", "host", "--seconds", "1"]);
    let mut pages = [viewed.listen(), viewed.listen()];
    for ((_, query), module) in pages.iter().zip(0..) {
        let wish = format!("{{\"inspect\": {module}}}");
        assert!(viewed.ask_by(query, &wish).starts_with("HTTP/1.1 200"));
    }
    assert!(viewed.ask(r#"{"until": 9}"#).starts_with("HTTP/1.1 200"));
    for ((stream, _), module) in pages.iter_mut().zip(0..) {
        let told = messages(stream);
        let modules: BTreeSet<_> = told.iter().filter_map(|told| told["module"]["module"].as_u64()).collect();
        assert_eq!(modules, BTreeSet::from([module]));
    }
}

#[test]
fn nobody_is_to_look_at_what_can_not_be_run() {
    let output = command::run(&["sim", "chain", "--view", "--images", "no/such/folder"]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("cannot read the image") && !message.contains("look at"), "{message}");
}

#[test]
fn what_can_not_be_done_is_said_and_nothing_happens() {
    let viewed = Viewed::start(&["sim", "chain", "--engine", "host", "--modules", "3"]);
    let refused = |wish: &str, why: &str| {
        let answer = viewed.ask(wish);
        assert!(answer.starts_with("HTTP/1.1 409") && answer.contains(why), "{wish}: {answer}");
    };
    refused("nonsense", "the request is not valid");
    refused(r#"{"event": "detach = '2.Back'"}"#, "nothing is attached to the Back dock of module 2");
    refused(r#"{"event": "detach = '9.Front'"}"#, "there is no module 9");
    refused(r#"{"event": "at = 3\nkill = 1"}"#, "duplicate key");
    refused(r#"{"event": "loss = 2"}"#, "give a probability from 0 to 1");
    refused(r#"{"event": "push = 1\nnewtons = [0, 9, 0]"}"#, "a push needs a world: ask for --world ground");
    refused(r#"{"inspect": 3}"#, "there is no module 3");
    refused(r#"{"event": "console = '0.Front'"}"#, "ask for --engine simavr");
    assert!(viewed.ask(r#"{"event": "detach = '1.Back'"}"#).starts_with("HTTP/1.1 200"));
    let timeline = viewed.ask(r#"{"timeline": null}"#);
    assert!(
        timeline.ends_with("shape = \"chain\"\nmodules = 3\n\n[[event]]\nat = 0.0\ndetach = \"1.Back\"\n"),
        "{timeline}"
    );
}

#[test]
fn what_can_not_happen_any_more_does_not_end_the_run() {
    let directory = tempfile::tempdir().unwrap();
    let robot = directory.path().join("robot.toml");
    std::fs::write(&robot, "modules = 3\nshape = \"chain\"\n[[event]]\nat = 0.5\ndetach = \"1.Back\"\n")
        .unwrap();
    let arguments = ["sim", robot.to_str().unwrap(), "--engine", "host", "--seconds", "1", "--json", "-"];
    let viewed = Viewed::start(&arguments);
    assert!(viewed.ask(r#"{"event": "detach = '1.Back'"}"#).starts_with("HTTP/1.1 200"));
    assert!(viewed.ask(r#"{"until": 9}"#).starts_with("HTTP/1.1 200"));
    assert_eq!(viewed.report()["simulated_seconds"], 1.0);
}

#[test]
fn what_is_done_by_hand_happens_at_whole_multiples_of_40_ms() {
    let directory = tempfile::tempdir().unwrap();
    let robot = directory.path().join("robot.toml");
    std::fs::write(&robot, "modules = 3\nshape = \"chain\"\nevent = [{ at = 0.01, reset = 2 }]").unwrap();
    let viewed = Viewed::start(&["sim", robot.to_str().unwrap(), "--engine", "host"]);
    assert!(viewed.ask(r#"{"until": 0.01}"#).starts_with("HTTP/1.1 200"));
    let happens = std::iter::repeat_with(|| viewed.now()).find(|&at| at > 0.0);
    assert_eq!(happens, Some(0.04));
}

#[test]
fn what_is_due_at_the_beginning_happens_before_what_is_done_by_hand() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.toml");
    let robot = "modules = 3\nshape = \"chain\"\n";
    let turned = "\n[[event]]\nat = 0.0\nroll = 90.0\n";
    std::fs::write(&file, format!("{robot}{turned}")).unwrap();
    let arguments = ["sim", file.to_str().unwrap(), "--engine", "host", "--loss", "0.9", "--seconds", "1"];
    let arguments = [&arguments[..], &["--json", "-"]].concat();
    let viewed = Viewed::start(&arguments);
    // If the event of --loss were in the file, it would come after this one and override it.
    assert!(viewed.ask(r#"{"event": "loss = 0"}"#).starts_with("HTTP/1.1 200"));
    let answer = viewed.ask(r#"{"timeline": null}"#);
    let saved = answer.split_once("\r\n\r\n").unwrap().1;
    assert!(saved.ends_with(&format!("{robot}{turned}\n[[event]]\nat = 0.0\nloss = 0.0\n")), "{saved}");
    assert!(viewed.ask(r#"{"until": 9}"#).starts_with("HTTP/1.1 200"));
    std::fs::write(&file, saved).unwrap();
    let again = command::run(&arguments);
    assert_eq!(viewed.report(), report(&String::from_utf8(again.stdout).unwrap()), "{saved}");
}

#[test]
fn what_is_saved_is_what_happened_and_still_can_also_when_the_run_is_over() {
    let directory = tempfile::tempdir().unwrap();
    let file = |text: &str| {
        let path = directory.path().join("robot.toml");
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let robot = file(
        "shape = \"chain\"\nmodules = 3\n\
         event = [{ at = 0.6, reset = 2 }, { at = 0.5, detach = \"1.Back\" }]",
    );
    let options = ["--engine", "host", "--loss", "0.01", "--seconds", "1", "--json", "-"];
    let mut viewed = Viewed::start(&[&["sim", &robot], &options[..]].concat());
    let saved = |viewed: &Viewed| {
        let answer = viewed.ask(r#"{"timeline": null}"#);
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        answer.split_once("\r\n\r\n").unwrap().1.to_owned()
    };
    assert!(viewed.ask(r#"{"event": "detach = '1.Back'"}"#).starts_with("HTTP/1.1 200"));
    let begun = saved(&viewed);
    assert!(viewed.ask(r#"{"until": 9}"#).starts_with("HTTP/1.1 200"));
    let reports = serde_json::Deserializer::from_reader(viewed.program.stdout.take().unwrap());
    let report: Value = reports.into_iter().next().unwrap().unwrap();
    let ended = saved(&viewed);
    let happens =
        "[[event]]\nat = 0.0\ndetach = \"1.Back\"\n\n[[event]]\nat = 0.6\nreset = 2\nmcu = \"both\"\n";
    for text in [begun, ended] {
        assert!(text.ends_with(&format!("\nshape = \"chain\"\nmodules = 3\n\n{happens}")), "{text}");
        let again = command::run(&[&["sim", &file(&text)], &options[..]].concat());
        let again: Value = serde_json::from_slice(&again.stdout).expect(&text);
        assert_eq!(again["state_hash"], report["state_hash"], "{text}");
    }
}

#[test]
fn what_is_saved_has_the_options_as_a_shell_takes_them_on_one_line_also_if_they_are_no_text() {
    let directory = tempfile::tempdir().unwrap();
    let robot = directory.path().join("it's\ntwo.toml");
    std::fs::write(&robot, "modules = 2\nshape = \"chain\"\n").unwrap();
    let images = OsStr::from_bytes(b"no \xff");
    let options = ["--engine", "host", "--images"].map(OsStr::new);
    let viewed = Viewed::start(&[&[OsStr::new("sim"), robot.as_os_str()], &options[..], &[images]].concat());
    let answer = viewed.ask(r#"{"timeline": null}"#);
    let (comment, rest) = answer.split_once("\r\n\r\n").unwrap().1.split_once('\n').unwrap();
    assert_eq!(rest, "modules = 2\nshape = \"chain\"\n", "{comment}");
    let expected = "it\\'s\\x0atwo.toml' --engine host --images 'no \u{fffd}' --view";
    assert!(comment.starts_with("# Saved from ./x sim $'/") && comment.ends_with(expected), "{comment}");
}
