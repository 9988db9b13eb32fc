//! Tests `./x gdb`: drives gdb as a user does, on a running robot.

mod command;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use command::{images, run};
use serde_json::Value;
use simavr_harness::{Image, Place};

/// A robot that is quick to run.
const ROBOT: [&str; 6] = ["chain", "--modules", "2", "--world", "none", "--seconds=1"];

/// In `Kernel`: the running task (kernel/src/ready.rs).
const RUNNING: u16 = 2;

/// Runs gdb with the commands in `lines`, and returns its output.
fn debug(arguments: &[&str], lines: &[&str]) -> Output {
    let commands: Vec<&str> = lines.iter().flat_map(|&line| ["-ex", line]).collect();
    run(&[&["gdb"], arguments, &ROBOT, &["--", "-nx", "-batch"], &commands].concat())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The cycles that `monitor time` has printed.
fn cycles(output: &str) -> Vec<u64> {
    let cycle = |line: &str| line.split_once(" s, cycle ")?.1.trim().parse().ok();
    output.lines().filter_map(cycle).collect()
}

/// A command of gdb that watches the low byte of the kernel's running task, in the master's image.
fn watch_running_task(command: &str) -> String {
    let image = Image::load(images().join("firmware-master.elf")).expect("./x build has left the image");
    let kernel = image.symbols().find(|(name, _)| name.ends_with("6kernel6KERNEL"));
    let Some(Place::Data(address)) = kernel.map(|(_, symbol)| symbol.place) else {
        panic!("there is no kernel")
    };
    format!("{command} *(unsigned char *) {:#x}", 0x80_0000 + u32::from(address + RUNNING))
}

#[test]
fn a_task_is_stopped_at_a_function_and_all_tasks_show_where_they_are() {
    let output = debug(
        &["1.master", "--at", "0.2"],
        &["break transmit", "continue", "backtrace", "info tasks", "thread apply all backtrace"],
    );
    let (told, error) = (text(&output.stdout), text(&output.stderr));
    let expect = |what: &str| assert!(told.contains(what), "no {what:?} in\n{told}\n{error}");
    // A frame of the task, with its line, and below it the closure that was given to the kernel.
    expect("hit Breakpoint 1");
    expect("at tasks/src/link/send.rs:");
    expect("at firmware-master/src/main.rs:");
    for task in ["HORMONE", "AC_SEND", "BRIDGE", "MOTORS", "RECEIVE"] {
        assert!(
            told.lines().any(|line| line.starts_with(&format!("{task} "))),
            "no {task} in\n{told}\n{error}"
        );
    }
    expect("(HORMONE: waits for HORMONE)):");
    expect("at hormone/src/task/hormone.rs:");
    assert!(output.status.success(), "{error}");
}

#[test]
fn a_watchpoint_is_hit_forward_and_back_and_the_run_ends_as_without_gdb() {
    let watch = watch_running_task("watch");
    let mut lines = vec!["set language c", &watch];
    for go in [
        "continue",
        "continue",
        "continue",
        "reverse-continue",
        "reverse-continue",
        "reverse-stepi",
        "continue",
    ] {
        lines.extend([go, "monitor time"]);
    }
    lines.extend(["delete", "continue", "monitor time"]);
    let output = debug(&["0.master", "--at=0.25"], &lines);
    let (told, error) = (text(&output.stdout), text(&output.stderr));
    let [first, second, third, back, further, step, again, end] = cycles(&error)[..] else {
        panic!("{told}\n{error}")
    };
    assert!(4_000_000 <= first && first < second && second < third, "{told}\n{error}");
    // The MCU stops after the instruction that writes, and on the way back before it.
    assert!((third - 4..third).contains(&back), "{told}\n{error}");
    assert!((second - 4..second).contains(&further), "{told}\n{error}");
    assert!(step < further, "{told}\n{error}");
    assert_eq!(again, second, "{told}\n{error}");
    // The run ends after the instruction in which the second ends, as without any stop.
    let unstopped = text(&debug(&["0.master", "--at=0.25"], &["continue", "monitor time"]).stderr);
    assert_eq!(cycles(&unstopped), [end], "{told}\n{error}");
    assert!((16_000_000..16_000_004).contains(&end), "{told}\n{error}");
    let alone = run(&[&["sim"], &ROBOT[..], &["--json", "-"]].concat());
    let report: Value = serde_json::from_slice(&alone.stdout).expect("the report is JSON");
    let hash = report["state_hash"].as_str().expect("it has the hash");
    assert!(error.contains(&format!("the run is over at 1 s, state hash {hash}")), "{hash}: {error}");
}

#[test]
fn what_reads_is_stopped_behind_its_instruction_and_on_the_way_back_before_it() {
    for command in ["rwatch", "awatch"] {
        let watch = watch_running_task(command);
        let mut lines = vec!["set language c", &watch];
        for go in ["continue", "continue", "reverse-continue"] {
            lines.extend([go, "monitor time"]);
        }
        lines.push("x/i $pc");
        let output = debug(&["0.master", "--at=0.25"], &lines);
        let (told, error) = (text(&output.stdout), text(&output.stderr));
        let [first, second, back] = cycles(&error)[..] else { panic!("{told}\n{error}") };
        assert!(4_000_000 <= first && first < second, "{told}\n{error}");
        assert!((second - 4..second).contains(&back), "{told}\n{error}");
        let next = told.lines().rfind(|line| line.starts_with("=> "));
        let load = next.is_some_and(|line| line.contains("\tld") && line.contains("KERNEL"));
        assert!(load || command == "awatch", "{told}\n{error}");
    }
}

#[test]
fn before_power_up_there_is_nothing_and_what_gdb_has_written_stays() {
    let lines = [
        "info tasks",
        "reverse-continue",
        "set language c",
        "stepi",
        "set var *(unsigned char *) 0x800020 = 0",
        "set var $r17 = 42",
        "stepi",
        "stepi",
        "reverse-stepi",
        "print $r17",
        "reverse-continue",
        "print $r17",
    ];
    let output = debug(&["0.slave"], &lines);
    let (told, error) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(told.matches("No more reverse-execution history").count(), 2, "{told}\n{error}");
    assert!(!told.contains("HORMONE") && !told.contains("BRIDGE"), "{told}");
    assert!(told.contains("$1 = 42") && told.contains("$2 = 42"), "{told}\n{error}");
}

#[test]
fn registers_are_written_by_their_addresses_too() {
    let lines = [
        "set language c",
        "set var *(unsigned char *) 0x800011 = 42",
        "set var *(unsigned char *) 0x80005d = 64",
        "set var *(unsigned char *) 0x80005f = 129",
        "printf \"by name %d %d %d\\n\", $r17, (int) $SP & 255, $SREG",
        // gdb writes all registers when one changes.
        "set var $r18 = 7",
        // The jump to the begin of the program.
        "stepi",
        "x/1ub 0x800011",
        "x/1ub 0x800012",
        "x/1ub 0x80005d",
        "x/1ub 0x80005f",
    ];
    let output = debug(&["0.master"], &lines);
    let (told, error) = (text(&output.stdout), text(&output.stderr));
    let values = ["by name 42 64 129", "0x800011:\t42", "0x800012:\t7", "0x80005d:\t64", "0x80005f:\t129"];
    for value in values {
        assert!(told.lines().any(|line| line == value), "no {value:?} in\n{told}\n{error}");
    }
}

#[test]
fn a_program_that_crashes_and_a_world_that_breaks_are_told_of_once() {
    let expect_once = |output: &Output, what: &str| {
        let error = text(&output.stderr);
        assert_eq!(error.matches(what).count(), 1, "{error}");
        let end = error.find("the run is over").expect("it ends");
        assert!(error.find(what).is_some_and(|told| told < end), "{error}");
    };
    // The flash is erased at that address.
    let crashed = debug(&["0.slave", "--at=0.2"], &["set var $PC2 = 0x1ff00", "continue"]);
    expect_once(&crashed, "superbot-sim: module 0: the Slave MCU crashed: ");

    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/breaks-the-world.toml");
    let robot = ["gdb", "0.master", file, "--", "-nx", "-batch", "-ex", "continue"];
    expect_once(&run(&robot), "superbot-sim: the world broke after 0.9");
}

/// The answer to a packet with this body, without the acknowledgement.
fn ask(gdb: &mut BufReader<TcpStream>, body: &str) -> String {
    let sum = body.bytes().fold(0, u8::wrapping_add);
    write!(gdb.get_mut(), "${body}#{sum:02x}").expect("it is heard");
    let mut answer = Vec::new();
    gdb.read_until(b'#', &mut answer).expect("it is answered");
    gdb.read_exact(&mut [0; 2]).expect("there is a sum");
    let answer = text(&answer);
    answer.trim_start_matches('+').trim_matches(['$', '#']).to_owned()
}

/// A server that debugs the master of module 0 in `robot`, and a connection to it.
fn serve(robot: &[&str]) -> (Child, BufReader<TcpStream>) {
    let mut server = Command::new(env!("CARGO_BIN_EXE_superbot-sim"));
    server.args([&["gdb", "0.master", "--at", "0.2", "--listen", "0"], robot].concat());
    let mut server = server.env("SUPERBOT_IMAGES", images()).stderr(Stdio::piped()).spawn().expect("it runs");
    let mut says = BufReader::new(server.stderr.take().expect("it says where it listens")).lines();
    let address = says.find_map(|line| Some(line.ok()?.split_once("target remote ")?.1.to_owned()));
    let gdb = TcpStream::connect(address.expect("it listens")).expect("it is there");
    gdb.set_read_timeout(Some(Duration::from_secs(60))).expect("a time can be set");
    (server, BufReader::new(gdb))
}

#[test]
fn a_packet_that_is_none_is_refused_and_what_gdb_has_set_up_stays() {
    let (mut server, mut gdb) = serve(&ROBOT);
    assert!(ask(&mut gdb, "qSupported:multiprocess+").contains("QStartNoAckMode+"));
    assert_eq!(ask(&mut gdb, "QStartNoAckMode"), "OK");
    let stopped = ask(&mut gdb, "vCont;s:p1.1");
    let tasks = ask(&mut gdb, "qfThreadInfo");
    let other = tasks.rsplit(',').next().expect("there are tasks").to_owned();
    assert!(other.starts_with("p01."), "{tasks}");
    let registers = |gdb: &mut _| ask(gdb, "g");
    let running = registers(&mut gdb);
    assert_eq!(ask(&mut gdb, &format!("Hg{other}")), "OK");
    let of_task = registers(&mut gdb);
    assert_ne!(of_task, running);
    let none = ["G00", "Z0", "Hg-1", "T0", "vCont;s", "vCont;x", "qRcmd,zz", "Z2,800100,100000000"];
    for packet in none.into_iter().chain(["Z2,8010ff,2"]) {
        let answer = ask(&mut gdb, packet);
        assert!(answer.starts_with('E'), "{packet}: {answer}");
        assert_eq!(registers(&mut gdb), of_task, "{packet}");
    }
    assert_eq!(ask(&mut gdb, "qfThreadInfo"), tasks);
    let again = ask(&mut gdb, "vCont;s:p1.1");
    assert_eq!(again, stopped, "it stops as before, and says so by the same name");
    assert_eq!(ask(&mut gdb, "D;1"), "OK");
    assert!(server.wait().expect("it ends").success());
}

#[test]
fn what_is_no_packet_is_refused_or_ignored_too_while_the_mcu_runs() {
    let (mut server, mut gdb) = serve(&["chain", "--modules", "2", "--world", "none", "--seconds", "86400"]);
    assert!(ask(&mut gdb, "qSupported:multiprocess+").contains("QStartNoAckMode+"));
    assert_eq!(ask(&mut gdb, "QStartNoAckMode"), "OK");
    // Between packets, a byte that begins none and a request to send again mean nothing.
    gdb.get_mut().write_all(b"x-").expect("it is heard");
    let before = ask(&mut gdb, "g");
    gdb.get_mut().write_all(b"$vCont;c#a8x-").expect("it is heard");
    for packet in ["G00", "Z0", "vCont;x", "qRcmd,zz"] {
        let answer = ask(&mut gdb, packet);
        assert!(answer.starts_with('E'), "{packet}: {answer}");
    }
    // A sum that is wrong.
    gdb.get_mut().write_all(b"$g#00").expect("it is heard");
    let mut refused = [0; 7];
    gdb.read_exact(&mut refused).expect("it is answered");
    assert_eq!(&refused, b"$E16#ac");
    // While the MCU runs, nothing can be written to it.
    assert!(ask(&mut gdb, "M800200,1:2a").starts_with('E'));
    gdb.get_mut().write_all(b"\x03").expect("it is heard");
    let mut stop = Vec::new();
    gdb.read_until(b'#', &mut stop).expect("it stops");
    gdb.read_exact(&mut [0; 2]).expect("there is a sum");
    assert!(stop.starts_with(b"$T02thread:p01."), "{}", text(&stop));
    assert_ne!(ask(&mut gdb, "g"), before, "it has run");
    assert_eq!(ask(&mut gdb, "D;1"), "OK");
    assert!(server.wait().expect("it ends").success());
}

#[test]
fn a_port_that_is_taken_is_told_before_the_robot_runs() {
    let taken = TcpListener::bind(("127.0.0.1", 0)).expect("there is a port");
    let port = taken.local_addr().expect("it has a number").port().to_string();
    let output = run(&[&["gdb", "0.master", "--at", "0.9", "--listen", &port], &ROBOT[..]].concat());
    let error = text(&output.stderr);
    assert!(output.status.code() == Some(2) && error.contains("give --listen another port"), "{error}");
    assert!(!error.contains("running up to"), "{error}");
}

#[test]
fn what_can_not_be_debugged_is_refused() {
    let refused = |arguments: &[&str], why: &str| {
        let output = run(&[&["gdb"], arguments, &["chain", "--modules", "2", "--world", "none"]].concat());
        let error = text(&output.stderr);
        assert!(output.status.code() == Some(2) && error.contains(why), "{error}");
        assert!(!error.contains("running up to"), "{error}");
    };
    refused(&["2.master"], "2.master: the robot's modules are 0 to 1");
    refused(&["0.master", "--at", "20"], "the run ends at 20 s; see --seconds");
    for option in [&["--json", "-"][..], &["--view"]] {
        refused(&[&["0.master"], option].concat(), "leave --json, --record, --trace and --view to ./x sim");
    }
    refused(&["0.master", "--at=0.5", "--gdb", "/no/gdb"], "can't start /no/gdb");
    refused(&["0.master", "--threads", "2"], "a robot in gdb runs on one thread: leave --threads out");
    refused(&["0.master", "--gdb", "/no/gdb", "--listen", "0"], "cannot be used with");
}
