//! Tests the program `superbot-sim`, as `./x sim` and users' CI run it.

mod command;

use std::fs::File;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use command::{images, run};
use serde_json::Value;

/// The whole standard output of the program.
fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&output.stdout)))
}

fn assert_refused(output: &Output, advice: &str) {
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains(advice), "{message}");
    assert!(output.stdout.is_empty());
}

#[test]
fn a_chain_of_five_ends_well_and_is_reported_as_json() {
    let output = run(&["sim", "chain", "--modules", "5", "--seconds", "3", "--json", "-"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let report = json(&output);
    let is_true = |holds: bool, field: &str| assert!(holds, "{field} in {report:#}");

    is_true(report["modules"] == 5, "modules");
    is_true(report["mcus"] == 10, "mcus");
    is_true(report["simulated_seconds"] == 3.0, "simulated_seconds");
    is_true(report["wall_seconds"].as_f64().is_some_and(|wall| wall > 0.0), "wall_seconds");
    is_true(report["wall_ratio"].as_f64().is_some_and(|ratio| ratio > 0.0), "wall_ratio");
    is_true(report["types"] == serde_json::json!({ "Head": 1, "Spine": 3, "Tail": 1 }), "types");
    is_true(report["topology_correct"] == true, "topology_correct");

    // A beat each half second, over four links.
    let sent = report["hormones_sent"].as_u64();
    is_true(sent.is_some_and(|sent| sent >= 4 * 5), "hormones_sent");
    is_true(report["hormones_delivered"].as_u64() == sent, "hormones_delivered");
    is_true(report["hormones_lost"] == 0, "hormones_lost");

    // A neighbour is found within 150 ms, and none is lost.
    is_true(
        report["discovery_ms_max"].as_f64().is_some_and(|ms| ms > 5.0 && ms <= 150.0),
        "discovery_ms_max",
    );
    is_true(report["loss_notice_ms_max"].is_null(), "loss_notice_ms_max");
    is_true(report["topology_lapses"] == 0, "topology_lapses");
    is_true(report["legs"] == 0 && report["gait_violations"] == 0, "gait_violations");

    let mean_and_max = |of: &Value, field: &str| {
        let [mean, max] = ["mean", "max"].map(|name| of[name].as_f64().unwrap_or(f64::NAN));
        is_true(mean > 0.0 && mean <= max, field);
        max
    };
    // A frame of 9 bytes takes 2.3 ms.
    is_true(mean_and_max(&report["hop_latency_us"], "hop_latency_us") > 2300.0, "hop_latency_us");
    is_true(report["hop_over_wire"].as_f64().is_some_and(|times| times > 1.0), "hop_over_wire");
    is_true(mean_and_max(&report["cpu_load"]["master"], "cpu_load.master") < 1.0, "cpu_load.master");
    is_true(mean_and_max(&report["cpu_load"]["slave"], "cpu_load.slave") < 1.0, "cpu_load.slave");

    is_true(report["link"]["frames"].as_u64().is_some_and(|frames| frames > 100), "link.frames");
    // While all modules find each other at the same time, an ACK may be late, once.
    let retries = report["link"]["retries"].as_u64();
    is_true(retries.is_some_and(|retries| retries <= 1), "link.retries");
    let first = json(&run(&["sim", "chain", "--modules", "5", "--seconds", "0.4", "--json", "-"]));
    is_true(first["link"]["retries"].as_u64() == retries, "link.retries since the first 0.4 s");
    // A module that powers up in the middle of a neighbour's frame hears the rest of the frame.
    is_true(report["link"]["errors"].as_u64().is_some_and(|errors| errors <= 8), "link.errors");
    let hash = report["state_hash"].as_str().unwrap_or_default();
    is_true(hash.len() == 16 && u64::from_str_radix(hash, 16).is_ok(), "state_hash");
}

#[test]
fn the_state_hash_follows_from_the_seed() {
    let hash = |options: &[&str]| {
        let arguments = ["sim", "six-legs", "--seconds", "0.5", "--json", "-"];
        json(&run(&[&arguments[..], options].concat()))["state_hash"].clone()
    };
    let first = hash(&["--threads", "1"]);
    assert_eq!(first, hash(&["--threads", "2"]));
    assert_eq!(first, hash(&["--core", "simavr"]));
    assert_ne!(first, hash(&["--seed", "2"]));
}

#[test]
fn legs_walk() {
    for engine in ["simavr", "host"] {
        let output = run(&["sim", "six-legs", "--engine", engine, "--seconds", "4", "--json", "-"]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let report = json(&output);
        let types = serde_json::json!({ "Branch": 3, "Head": 1, "LeftLeg": 3, "RightLeg": 3, "Tail": 1 });
        assert_eq!(report["types"], types);
        assert_eq!((&report["engine"], &report["legs"]), (&engine.into(), &6.into()));
        assert_eq!(report["gait_violations"], 0);
        assert!(report["leg_skew_us_max"].as_f64().is_some_and(|us| us > 0.0 && us <= 2000.0), "{report:#}");
        assert!(report["recovery_periods_max"].as_f64().is_some_and(|periods| periods <= 1.3), "{report:#}");
        assert_eq!(report["cpu_load"].is_null(), engine == "host");
    }
}

#[test]
fn a_hundred_modules_walk_natively() {
    let output = run(&["sim", "--engine", "host", "--json", "-"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let report = json(&output);
    assert_eq!((&report["modules"], &report["mcus"]), (&100.into(), &0.into()));
    assert_eq!((&report["simulated_seconds"], &report["legs"]), (&20.0.into(), &48.into()));
}

#[test]
fn frames_are_lost_as_asked_for() {
    let report = |loss| {
        let output = run(&["sim", "chain", "--seconds", "3", "--json", "-", "--loss", loss]);
        (output.status.code(), json(&output))
    };
    let (status, lossy) = report("0.2");
    assert_eq!(lossy["loss"], 0.2);
    assert!(lossy["link"]["retries"].as_u64().is_some_and(|retries| retries > 0), "{lossy:#}");
    assert_eq!(status, Some(0), "{lossy:#}");
    let (status, deaf) = report("1");
    // No module hears another, and each module's view is right; but there is no head.
    assert_eq!((status, &deaf["topology_correct"]), (Some(1), &Value::Bool(true)), "{deaf:#}");
}

#[test]
fn shapes_have_their_modules() {
    let output = run(&["sim", "ring", "--seconds", "0.3", "--json", "-"]);
    let report = json(&output);
    assert_eq!(report["types"], serde_json::json!({ "Spine": 6 }));
    assert_eq!(report["topology_correct"], true);
}

#[test]
fn a_robot_file_is_run_through_its_changes() {
    let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots");
    let file = robots.join("changes.toml");
    let output = run(&["sim", file.to_str().expect("the path is text"), "--seconds", "19", "--json", "-"]);
    let report = json(&output);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    // At 18 s the module behind the head lost its power, and left the head alone.
    assert_eq!(report["types"], serde_json::json!({ "Head": 1, "Other": 1, "Spine": 3, "Tail": 1 }));
    assert_eq!(report["topology_correct"], true);
    let ms = |field: &str| report[field].as_f64().unwrap_or(f64::NAN);
    assert!(ms("discovery_ms_max") <= 150.0, "{report:#}");
    // On a link that lost frames a neighbour has up to 900 ms.
    assert!((200.0..=950.0).contains(&ms("loss_notice_ms_max")), "{report:#}");

    let output =
        run(&["sim", file.to_str().expect("the path is text"), "--engine", "host", "--seconds", "16"]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("did not happen: 2; see --seconds"), "{message}");

    let broken = Path::new(env!("CARGO_TARGET_TMPDIR")).join("broken.toml");
    std::fs::write(&broken, "modules = 2\ndocks = [[\"0.Back\", \"2.Front\"]]\n")
        .expect("the file can be written");
    let broken = broken.to_str().expect("the path is text");
    assert_refused(&run(&["sim", broken]), "line 2: there is no module 2");
    assert_refused(&run(&["sim", broken, "--modules", "2"]), "leave --modules out");
    assert_refused(&run(&["sim", "no/such/robot.toml"]), "can't read no/such/robot.toml");
}

#[test]
fn an_event_at_docks_that_the_robot_has_closed_is_said_and_the_run_is_reported() {
    let ring = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/ring.toml");
    let ring = std::fs::read_to_string(ring).unwrap();
    let directory = tempfile::tempdir().unwrap();
    let run_with = |event: &str| {
        let file = directory.path().join("robot.toml");
        std::fs::write(&file, format!("{ring}\n[[event]]\nat = 9\n{event}\n")).unwrap();
        run(&["sim", file.to_str().unwrap(), "--engine", "host", "--seconds", "10", "--json", "-"])
    };
    let order = run_with("command = [0xd0, 2, 255]\nto = \"0.Front\"");
    assert_eq!(order.status.code(), Some(1));
    let faults = &json(&order)["faults"];
    let said = faults[0].as_str().expect("there is one");
    assert!(
        said.starts_with("an event could not happen at 9 s") && said.contains("attached already"),
        "{said}"
    );
    assert!(faults[1].is_null() && String::from_utf8_lossy(&order.stderr).contains(said), "{faults}");
    let detach = run_with("detach = \"0.Front\"");
    assert_ne!(detach.status.code(), Some(2), "{}", String::from_utf8_lossy(&detach.stderr));
    assert!(!json(&detach)["faults"].to_string().contains("could not happen"));
}

#[test]
fn an_order_before_the_power_comes_is_heard_by_nobody_in_either_engine() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.toml");
    let order = "[[event]]\nat = 0\ncommand = [0xd2, 1, 255]\nto = \"0.Front\"\n";
    std::fs::write(&file, format!("modules = 2\nshape = \"chain\"\n{order}")).unwrap();
    // The order is sent for the last time after 30 ms. With the two seeds, power comes after 26.5 and 30.1
    // ms.
    for (seed, faults) in [("62", 0), ("63", 1)] {
        for engine in ["simavr", "host"] {
            let robot = ["sim", file.to_str().unwrap(), "--engine", engine, "--world", "none"];
            let output = run(&[&robot[..], &["--seed", seed, "--seconds", "3", "--json", "-"]].concat());
            let report = json(&output);
            let told = report["faults"].as_array().unwrap();
            assert_eq!(told.len(), faults, "{engine}, {seed}: {told:?}");
            let is_unheard = |fault: &Value| fault.as_str().unwrap().starts_with("nobody heard an order");
            assert!(told.iter().all(is_unheard), "{told:?}");
        }
    }
}

#[test]
fn where_the_world_broke_nothing_is_said_of_a_longer_run() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.toml");
    let breaks = include_str!("breaks-the-world.toml");
    std::fs::write(&file, breaks.to_owned() + "[[event]]\nat = 2\nreset = 0\n").unwrap();
    let robot = ["sim", file.to_str().unwrap(), "--engine", "host", "--world", "ground"];
    let output = run(&[&robot[..], &["--seconds", "3"]].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("the world broke after 0.9"), "{message}");
    assert!(!message.contains("did not happen") && !message.contains("run for more"), "{message}");
}

#[test]
fn a_run_ends_at_the_time_that_it_was_asked_for() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.toml");
    // 1.001 s times the clock rate is just less than a whole number of cycles.
    std::fs::write(&file, "modules = 2\nshape = \"chain\"\n[[event]]\nat = 1.001\nreset = 0\n").unwrap();
    let output =
        run(&["sim", file.to_str().unwrap(), "--engine", "host", "--seconds", "1.001", "--json", "-"]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(json(&output)["simulated_seconds"], 1.001);
    assert!(!message.contains("did not happen"), "{message}");
}

#[test]
fn modules_have_the_images_that_a_robot_file_names() {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mixed");
    std::fs::create_dir_all(&directory).expect("the directory can be made");
    for name in ["firmware-master.elf", "firmware-slave.elf"] {
        std::fs::copy(images().join(name), directory.join(name)).expect("./x build leaves it");
    }
    std::fs::write(directory.join("text.elf"), "no program").expect("the file can be written");
    let mut cut = std::fs::read(images().join("firmware-master.elf")).expect("./x build leaves it");
    let segments = u32::from_le_bytes(cut[28..32].try_into().expect("four bytes")) as usize;
    let in_file = segments + 16; // how many bytes of it the first one has
    cut[in_file..][..4].copy_from_slice(&0x7fff_ffff_u32.to_le_bytes());
    std::fs::write(directory.join("cut.elf"), cut).expect("the file can be written");
    let file = directory.join("robot.toml");
    let run_with = |image: &str, options: &[&str]| {
        std::fs::write(&file, format!("modules = 2\nshape = \"chain\"\n{image}"))
            .expect("the file can be written");
        let robot = ["sim", file.to_str().expect("the path is text"), "--seconds", "2", "--world", "none"];
        run(&[&robot, options].concat())
    };
    let hash = |image: &str| {
        let output = run_with(image, &["--json", "-"]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        json(&output)["state_hash"].clone()
    };
    let same = "[[image]]\nmodules = [1]\nmaster = \"firmware-master.elf\"\nslave = \"firmware-slave.elf\"";
    assert_eq!(hash(""), hash(same));

    let refused = |image: &str, advice: &str| {
        assert_refused(&run_with(&format!("[[image]]\nmodules = [1]\n{image}"), &[]), advice);
    };
    refused("master = \"gone.elf\"", "mixed/gone.elf: `master` and `slave` of an [[image]] are paths from");
    refused("slave = \"text.elf\"", "text.elf: not an ELF file");
    refused("master = \"cut.elf\"", "cut.elf: a segment reaches beyond the end of the file");
    refused("master = \"firmware-slave.elf\"", "module 1: the master's image has no MODULE_STATUS");
    let output = run_with(same, &["--engine", "host"]);
    assert_refused(&output, "take each [[image]] out, or ask for --engine simavr");
}

#[test]
fn a_console_is_asked_and_what_it_tells_is_reported() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/console.toml");
    let output = run(&["sim", file, "--seconds", "5", "--json", "-"]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{told}");
    let report = json(&output);
    let console = &report["consoles"][0];
    let is_right = console["at"] == 3.0 && console["dock"] == "1.Up" && console["complete"] == true;
    assert!(is_right && report["consoles"][1].is_null(), "{report:#}");
    let text = console["text"].as_str().expect("a text");
    assert!(text.starts_with("SuperBot ") && told.contains(text), "{told}");

    let cut = run(&["sim", file, "--seconds", "3.5", "--json", "-"]);
    let console = &json(&cut)["consoles"][0];
    let begun = console["text"].as_str().expect("a text");
    assert!(console["complete"] == false && !begun.is_empty() && begun.len() < text.len(), "{console:#}");

    assert_refused(&run(&["sim", file, "--engine", "host"]), "--engine simavr");
}

#[test]
fn the_summary_is_for_people_and_json_can_go_to_a_file() {
    let output = run(&["sim", "chain", "--seconds", "2"]);
    assert_eq!(output.status.code(), Some(0));
    let summary = String::from_utf8(output.stdout).expect("the summary is text");
    assert!(summary.starts_with("5 modules, 10 MCUs: 2 s simulated"), "{summary}");
    assert!(summary.contains("1 Head, 3 Spine, 1 Tail (as wired)"), "{summary}");

    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report.json");
    let output = run(&["sim", "chain", "--seconds", "2", "--json", file.to_str().expect("the path is text")]);
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stdout.is_empty());
    let report = std::fs::read(file).expect("the file is there");
    assert_eq!(serde_json::from_slice::<Value>(&report).expect("the file is JSON")["modules"], 5);
}

#[test]
fn a_robot_that_had_no_time_fails_and_says_why() {
    let output = run(&["sim", "chain", "--modules", "5", "--seconds", "0.05", "--json", "-"]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(json(&output)["hormones_delivered"], 0);
    // An MCU whose program has not begun counts as 0, whatever its RAM holds.
    let report = json(&run(&["sim", "chain", "--seconds", "0.001", "--json", "-"]));
    assert_eq!((&report["link"]["frames"], &report["bridge"]["messages"]), (&0.into(), &0.into()));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("no hormone was delivered: run longer"), "{message}");
}

#[test]
fn what_can_not_be_run_is_refused_with_advice() {
    for (arguments, advice) in [
        (["sim", "--modules", "0"], "give a number of modules from 1 to 1000000"),
        (["sim", "--modules", "five"], "give a number of modules from 1 to 1000000"),
        (["sim", "--modules", "1001"], "--engine host"),
        (["sim", "--seconds", "0"], "give a time from 0.001 to 86400 seconds"),
        (["sim", "--seconds", "nan"], "give a time from 0.001 to 86400 seconds"),
        (["sim", "--seconds", "-3"], "give a time from 0.001 to 86400 seconds"),
        (["sim", "--threads", "0"], "give a number of threads from 1 to 256"),
        (["sim", "--seed", "x"], "--seed"),
        (["sim", "--loss", "2"], "give a probability from 0 to 1"),
        (["sim", "square", "--json"], "give one of centipede, chain, ring"),
        (["sim", "--colour", "red"], "--help"),
        (["simulate", "chain", "-"], "--help"),
    ] {
        assert_refused(&run(&arguments), advice);
    }
    for threads in ["0", "-1", "257"] {
        let arguments = ["plot", "hops", "no/such/folder/plot.svg", "--threads", threads];
        assert_refused(&run(&arguments), "give a number of threads from 1 to 256");
    }
    assert_refused(&run(&["sim", "six-legs", "--modules", "10"]), "at least 11 modules");
    for table in ["terrain", "period"] {
        assert_refused(&run(&[table, "--modules", "1002"]), "simavr runs up to 1000 modules");
        // A negative number is parsed as a value, not as an option.
        assert_refused(&run(&[table, "--modules", "-5"]), "give a number of modules from 1 to 1000000");
        assert_refused(&run(&[table, "--threads", "-1"]), "give a number of threads from 1 to 256");
        assert_refused(&run(&[table, "--seconds", "-3"]), "-3 is not in");
        assert_refused(&run(&[table, "--seed", "-1"]), "invalid value '-1' for '--seed <SEED>'");
    }
    assert_refused(&run(&["gdb", "0.master", "--listen", "-1"]), "-1 is not in");
    assert_refused(&run(&[]), "sim");
    let nowhere = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no/such/folder/report.json");
    let nowhere = nowhere.to_str().expect("the path is text");
    // These errors come before anything is run.
    assert_refused(&run(&["sim", "chain", "--images", "no/such/folder", "--json", nowhere]), "can't write");
    assert_refused(&run(&["bench", "--images", "no/such/folder", "--json", nowhere]), "can't write");
    assert_refused(&run(&["response", "--svg", nowhere]), "give --svg another path");
}

const QUICK: [&str; 6] = ["sim", "chain", "--engine", "host", "--seconds", "2"];

/// Runs the program with its standard output and standard error redirected.
fn run_into(arguments: &[&str], output: Stdio, said: Stdio) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_superbot-sim"));
    program.env("SUPERBOT_IMAGES", images());
    program.args(arguments).stdout(output).stderr(said).output().expect("the program can be run")
}

#[test]
fn where_nobody_hears_it_the_program_does_not_panic() {
    let full = || Stdio::from(File::create("/dev/full").expect("Linux has it"));
    let json = [QUICK.as_slice(), &["--json", "-"]].concat();
    for arguments in [QUICK.as_slice(), &json] {
        let (reader, writer) = std::io::pipe().expect("there are pipes");
        drop(reader);
        for output in [full(), writer.into()] {
            assert_refused(
                &run_into(arguments, output, Stdio::piped()),
                "can't write to the standard output",
            );
        }
        assert_eq!(run_into(arguments, Stdio::piped(), full()).status.code(), Some(0));
    }
}

#[test]
fn a_closed_standard_output_is_an_error_and_a_report_for_it_is_refused_before_the_run() {
    let closed = |command: &str| {
        let program = env!("CARGO_BIN_EXE_superbot-sim");
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("{program} sim chain --engine host --seconds {command} >&-")]);
        shell.output().expect("there is a shell")
    };
    for command in ["1", "86400 --json -"] {
        assert_refused(&closed(command), "the standard output is closed");
    }
    let elsewhere = closed("1 --json /dev/null");
    assert!(!String::from_utf8_lossy(&elsewhere.stderr).contains("closed"), "{elsewhere:?}");
}

#[test]
fn a_listing_that_can_not_be_printed_is_an_error_that_says_so() {
    for listing in [&["--listing", "kernel_flash_bytes_with_calls"][..], &["--windows"]] {
        let full = File::create("/dev/full").expect("Linux has it");
        let arguments = [&["bench"], listing].concat();
        assert_refused(
            &run_into(&arguments, full.into(), Stdio::piped()),
            "can't write to the standard output",
        );
    }
}

#[test]
fn a_report_is_written_whole_or_leaves_the_file_as_it_was() {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("reports");
    let _ = std::fs::remove_dir_all(&directory);
    std::fs::create_dir(&directory).expect("it can be made");
    let path = |name: &str| directory.join(name).to_str().expect("the path is text").to_owned();
    let [report, robot, pipe] = ["report.json", "robot.toml", "pipe"].map(path);
    std::fs::write(&robot, "modules = 0").expect("it can be written");

    // A run that is refused leaves no file.
    assert_refused(&run(&["sim", &robot, "--engine", "host", "--json", &report]), "give a number of modules");
    assert_refused(&run(&["sim", &robot, "--engine", "host", "--json", &robot]), "is the robot file");
    let made = Command::new("mkfifo").arg(&pipe).status().expect("coreutils has it");
    assert!(made.success());
    assert_refused(&run(&[QUICK.as_slice(), &["--json", &pipe]].concat()), "no program reads it");
    let names = || std::fs::read_dir(&directory).expect("it is there").count();
    assert_eq!(names(), 2, "the robot file and the pipe");

    // A run that a signal ends leaves the old file as it was.
    std::fs::write(&report, "before").expect("it can be written");
    let long = ["sim", "chain", "--engine", "host", "--seconds", "86400", "--json", &report];
    let mut program = Command::new(env!("CARGO_BIN_EXE_superbot-sim"));
    let mut running = program.args(long).spawn().expect("the program can be run");
    std::thread::sleep(std::time::Duration::from_millis(300));
    running.kill().expect("it runs");
    assert!(!running.wait().expect("it ends").success());
    assert_eq!(std::fs::read_to_string(&report).expect("it is there"), "before");
    assert_eq!(names(), 3);

    assert_eq!(run(&[QUICK.as_slice(), &["--json", &report]].concat()).status.code(), Some(0));
    let written = std::fs::read(&report).expect("it is there");
    assert_eq!(serde_json::from_slice::<Value>(&written).expect("it is JSON")["modules"], 5);
    assert_eq!(names(), 3);
}

/// As a file that is mounted into a container. Without user namespaces it can't be tried.
#[test]
fn a_report_goes_into_a_file_that_can_not_be_replaced() {
    let directory = tempfile::tempdir().unwrap();
    let [file, mounted] = ["file", "mounted"].map(|name| directory.path().join(name));
    for path in [&file, &mounted] {
        std::fs::write(path, "before ".repeat(1000)).unwrap();
    }
    let program = env!("CARGO_BIN_EXE_superbot-sim");
    let script = r#"mount --bind "$1" "$2" || exit 9; shift; shift; exec "$@""#;
    let mut shell = Command::new("unshare");
    shell.args(["--map-root-user", "--mount", "sh", "-c", script, "sh"]).args([&file, &mounted]);
    let output =
        shell.arg(program).args(QUICK).arg("--json").arg(&mounted).output().expect("util-linux has it");
    let message = String::from_utf8_lossy(&output.stderr);
    if message.starts_with("unshare") || output.status.code() == Some(9) {
        eprintln!("left out: {message}");
        return;
    }
    assert_eq!(output.status.code(), Some(0), "{message}");
    let written = std::fs::read(&file).unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&written).expect("it is JSON")["modules"], 5);
}

#[test]
fn a_report_goes_to_where_a_link_leads_and_the_link_stays() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let report = |name: &str| run(&[QUICK.as_slice(), &["--json", &path(name)]].concat());
    let links = [("far", "near"), ("near", "./new.json"), ("lost", "gone/new.json"), ("loop", "loop")];
    for (link, target) in links {
        symlink(target, path(link)).unwrap();
    }
    // First the file does not exist yet, then it does.
    for _ in 0..2 {
        assert_eq!(report("far").status.code(), Some(0));
        let written = std::fs::read(path("new.json")).unwrap();
        assert_eq!(serde_json::from_slice::<Value>(&written).unwrap()["modules"], 5);
    }
    assert_refused(&report("lost"), "give --json another path");
    assert_refused(&report("loop"), "give --json another path");
    for (link, target) in links {
        assert_eq!(std::fs::read_link(path(link)).unwrap(), Path::new(target));
    }
    let output = run(&[QUICK.as_slice(), &["--json", "/dev/stdout"]].concat());
    assert_eq!(json(&output)["modules"], 5);
}

#[test]
fn flash_is_listed_function_by_function() {
    let output = run(&["bench", "--listing", "kernel_flash_bytes_with_calls"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("the listing is text");
    let (heading, lists) = text.split_once("\n\n").expect("a heading");
    let mut sums = 0;
    for list in lists.split("\n\n") {
        let bytes: Vec<i64> = list
            .lines()
            .map(|line| line.split_whitespace().next().and_then(|bytes| bytes.parse().ok()).expect("bytes"))
            .collect();
        assert_eq!(bytes[0], bytes[1..].iter().sum::<i64>(), "{list}");
        assert!(bytes[1..].is_sorted_by(|a, b| a >= b), "{list}");
        sums += bytes[0];
    }
    assert!(heading.contains(&format!(": {sums} bytes ")), "{heading}");

    assert_refused(&run(&["bench", "--listing", "task_bytes"]), "counts neither cycles nor flash");
}

/// `./x bench` asks for the help before it builds the test images, which takes minutes.
#[test]
fn a_figure_that_is_none_is_refused_before_anything_is_measured() {
    assert_refused(&run(&["bench", "--listing", "yield_cycle", "--help"]), "there is no such figure");
}

#[test]
fn what_tasks_and_one_loop_are_not_measured_on_is_told() {
    assert_refused(
        &run(&["bench", "concurrency", "--images", "no/such/folder"]),
        "./x bench concurrency builds it",
    );
    assert_refused(&run(&["bench", "concurrency", "--windows"]), "leave --listing and --windows out");
    assert_refused(&run(&["bench", "concurrency", "--seconds", "0"]), "0 is not in 1..");
    assert_refused(&run(&["bench", "concurrency", "--seconds", "86401"]), "86401 is not in 1..=86400");
    assert_refused(
        &run(&["bench", "concurrency", "--svg", "/no/such/folder/a.svg"]),
        "give --svg another path",
    );
    assert_refused(&run(&["bench", "module", "--svg", "a.svg"]), "leave --svg out");
    for subject in ["kernel", "simulator"] {
        assert_refused(&run(&["bench", subject, "--seconds", "5"]), "leave --seconds out");
    }
}

#[test]
fn a_plot_does_not_go_where_the_report_goes() {
    let directory = tempfile::tempdir().unwrap();
    let [one, other] =
        ["figures", "./figures"].map(|name| directory.path().join(name).to_str().unwrap().to_owned());
    for command in [&["period"][..], &["bench", "concurrency"]] {
        let files = ["--images", "no/such/folder", "--json", &one, "--svg", &other];
        let output = run(&[command, &files].concat());
        assert_refused(&output, &format!("--json already writes {other}: give --svg another path"));
    }
    assert!(std::fs::read_dir(&directory).unwrap().next().is_none());
}

#[test]
fn where_a_plot_can_not_be_written_the_figures_are_told_all_the_same() {
    let output = run(&["period", "--modules", "1", "--seconds", "7", "--svg", "/dev/full"]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("can't write /dev/full"), "{message}");
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("| 0.5 s |") && table.contains("| 4 s |"), "{table}");
}

#[test]
fn images_that_are_not_there_can_be_built() {
    assert_refused(&run(&["sim", "--images", "no/such/folder"]), "./x build");
    assert_refused(&run(&["bench", "--images", "no/such/folder"]), "./x bench");
    assert_refused(&run(&["sim", "--images", env!("CARGO_MANIFEST_DIR")]), "firmware-master.elf");
}

#[test]
fn a_robot_that_was_told_to_walk_and_does_not_ends_with_status_1() {
    let file = std::env::temp_dir().join(format!("superbot-still-{}.toml", std::process::id()));
    // A centipede without legs.
    let text = "modules = 2\nshape = 'chain'\n[[event]]\nat = 1\ncommand = [0xd1, 1, 255]\nto = '0.Front'\n";
    std::fs::write(&file, text).unwrap();
    let output = run(&["sim", file.to_str().unwrap(), "--seconds", "9", "--json", "-"]);
    std::fs::remove_file(&file).unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("does not walk"), "{message}");
    let report = json(&output);
    assert_eq!(report["world"], "ground");
    // The robot stands, so there are no figures relative to its way.
    assert!(report["distance_m"].as_f64().is_some_and(|distance| distance.abs() < 0.001), "{report:#}");
    assert!(report["sideways_percent"].is_null() && report["slip_percent"].is_null(), "{report:#}");
    assert!(report["metres_per_charge"].is_null(), "{report:#}");
}

#[test]
fn a_robot_that_was_told_late_to_walk_has_to_come_as_far_as_since_then() {
    let file = std::env::temp_dir().join(format!("superbot-late-{}.toml", std::process::id()));
    let text = "modules = 5\nshape = 'chain'\n[[event]]\nat = 12\ncommand = [0xd2, 1, 255]\nto = '0.Front'\n";
    std::fs::write(&file, text).unwrap();
    for seconds in ["14", "21"] {
        let native = ["--engine", "host", "--world", "ground", "--seconds", seconds];
        let output = run(&[&["sim", file.to_str().unwrap()], &native[..]].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{seconds}: {message}");
    }
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn without_a_world_nothing_is_said_of_motion() {
    let output = run(&["sim", "chain", "--modules", "2", "--seconds", "2", "--world", "none", "--json", "-"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let report = json(&output);
    assert_eq!(report["world"], "none");
    assert!(report["distance_m"].is_null() && report["slip_percent"].is_null(), "{report:#}");
    assert!(report["heading_degrees"].is_null(), "{report:#}");
}

#[test]
fn the_native_engine_has_a_world_where_it_is_asked_for() {
    let chain = ["sim", "chain", "--engine", "host", "--world", "ground", "--seconds", "2", "--json", "-"];
    let report = json(&run(&chain));
    assert_eq!(report["world"], "ground");
    assert!(report["distance_m"].is_number() && report["charge_percent_max"].is_number(), "{report:#}");
    assert_eq!(report["trouble"], Value::Null);
    assert_eq!(report["state_hash"], json(&run(&chain))["state_hash"]);
    let [noisy, again] = [(); 2].map(|()| json(&run(&[&chain[..], &["--vary", "converter=0.4%"]].concat())));
    assert_ne!(report["state_hash"], noisy["state_hash"]);
    assert_eq!(noisy["state_hash"], again["state_hash"]);
    let many = ["sim", "chain", "--modules", "1001", "--engine", "host", "--world", "ground"];
    assert_refused(&run(&many), "up to 1000 modules");
    let varied = ["sim", "chain", "--engine", "host", "--vary", "mass=20%"];
    assert_refused(&run(&varied), "ask for --world ground");
}

#[test]
fn the_native_engine_has_no_images() {
    assert_refused(&run(&["sim", "--engine", "host", "--core", "simavr"]), "leave --core out");
}

#[test]
fn a_run_that_is_recorded_is_the_same_run() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("run.html");
    for robot in [&["chain", "--seconds", "0.5"][..], &["centipede", "--engine", "host", "--seconds", "2"]] {
        let report = |record: &[&str]| {
            let output = run(&[&["sim", "--loss", "0.1", "--json", "-"], robot, record].concat());
            let mut report = json(&output);
            for field in ["wall_seconds", "wall_ratio", "cost"] {
                report[field].take();
            }
            report
        };
        assert_eq!(report(&[]), report(&["--record", page.to_str().unwrap()]));
        let page = std::fs::read_to_string(&page).unwrap();
        assert!(page.contains("id=\"about\">{\"robot\":\"") && page.contains("id=\"recording\">"));
        assert!(page.len() < 1_000_000, "{}", page.len());
    }
}

#[test]
fn what_can_not_be_recorded_is_refused_before_it_runs() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let robot = at("robot.toml");
    std::fs::write(&robot, "modules = 2\nshape = \"chain\"\n").unwrap();
    let sim = |arguments: &[&str]| run(&[&["sim", "--engine", "host"], arguments].concat());
    let record = |path: &str| sim(&["chain", "--record", path]);
    assert_refused(&record("-"), "the standard output has the summary: give --record a file");
    assert_refused(&record(&at("")), "give --record another path");
    assert_refused(&record(&at("nowhere/run.html")), "give --record another path");
    // Paths of directories that do not exist, and of one that is a file.
    for folder in ["nowhere/", "nowhere/.", "robot.toml/"] {
        assert_refused(&record(&at(folder)), "give --record another path");
    }
    assert_refused(&sim(&[&robot, "--record", &robot]), "is the robot file: give --record another path");
    for name in ["run.json", "robot.toml"] {
        let path = at(name);
        let both = sim(&["chain", "--json", &path, "--record", &path]);
        assert_refused(&both, &format!("--json already writes {path}: give --record another path"));
    }
    let spelled = sim(&["chain", "--json", &at("new"), "--record", &at("./new")]);
    assert_refused(&spelled, &format!("--json already writes {}: give --record another path", at("./new")));
    let large = sim(&["chain", "--modules", "1000", "--seconds", "101", "--record", &at("run.html")]);
    assert_refused(&large, "leave --record out, or ask for 100 s at most, or for fewer modules");
    let larger = sim(&["chain", "--modules", "200000", "--record", &at("run.html")]);
    assert_refused(&larger, "or ask for 0.5 s at most");
    let left: Vec<_> = std::fs::read_dir(&directory).unwrap().map(|file| file.unwrap().file_name()).collect();
    assert_eq!(left, ["robot.toml"]);
}

/// The output of the program on a terminal of this size, or in a pipe if `terminal` is `None`.
fn drawn(terminal: Option<(usize, usize)>, no_color: bool) -> String {
    let program = env!("CARGO_BIN_EXE_superbot-sim");
    let run = format!("'{program}' {} 2>&1 >/dev/null", QUICK.join(" "));
    let mut command = match terminal {
        Some((rows, columns)) => {
            let mut script = Command::new("script"); // of the essential package bsdutils
            script.args(["-qec", &format!("stty rows {rows} cols {columns}; {run}"), "/dev/null"]);
            script
        }
        None => {
            let mut shell = Command::new("sh");
            shell.args(["-c", &run]);
            shell
        }
    };
    command.env("TERM", "xterm-256color").env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
    if no_color {
        command.env("NO_COLOR", "1");
    }
    let output = command.stdin(Stdio::null()).output().expect("it can be run");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_terminal_shows_a_table_and_a_pipe_a_line_a_second() {
    const RED: &str = "\x1b[31m";
    let wide = drawn(Some((24, 100)), false);
    assert!(wide.contains("100 %, 0 s left, 2.00 of 2.00 s"), "{wide:?}");
    assert!(wide.contains(RED) && wide.contains("changes"), "{wide:?}");
    let narrow = drawn(Some((6, 30)), false);
    assert!(narrow.contains("action") && !narrow.contains("changes"), "{narrow:?}");
    assert!(narrow.contains("... 3 more"), "{narrow:?}");
    let plain = drawn(Some((24, 100)), true);
    assert!(plain.contains("Head") && !plain.contains(RED), "{plain:?}");
    let lines = drawn(None, false);
    assert!(!lines.contains('\x1b') && lines.lines().count() == 2, "{lines:?}");
}
