//! The messages of `x` when it is called wrongly, before it installs or builds anything.

#![cfg(unix)]

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const X: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../x");

/// A call of `x` in an environment in which it installs and builds nothing: the name of a program that does
/// not exist ends its set-up.
fn x(path: impl AsRef<Path>, arguments: &[&str]) -> Command {
    let mut command = Command::new("bash");
    command.arg(path.as_ref()).args(arguments).env("SUPERBOT_AVR_CARGO", "no-such-program");
    command.env_remove("CARGO_TARGET_DIR").env_remove("CDPATH");
    command
}

/// The exit status of `x`, and its messages.
fn said(mut command: Command) -> (Option<i32>, String) {
    let Output { status, stdout, stderr } = command.output().expect("bash is there");
    assert_eq!(String::from_utf8_lossy(&stdout), "", "only stderr says what is wrong");
    (status.code(), String::from_utf8_lossy(&stderr).into_owned())
}

/// A copy of `x` in a folder of this name below `of`.
fn copy(of: &Path, folder: &str) -> PathBuf {
    let folder = of.join(folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    fs::copy(X, folder.join("x")).expect("x can be copied");
    folder.join("x")
}

/// An empty folder for a test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("the folder of an earlier run can be removed");
    }
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

/// The commands in the last `case` of `x`.
fn commands() -> BTreeSet<String> {
    let text = fs::read_to_string(X).expect("x is there");
    let (_, cases) = text.rsplit_once("\ncase ").expect("x tells its commands apart");
    let cases = cases.replace("\\\n", "");
    let patterns = cases.lines().filter_map(|line| Some(line.split_once(") ")?.0)).collect::<Vec<_>>();
    let names = patterns.iter().flat_map(|pattern| pattern.split('|')).map(str::trim);
    names
        .filter(|name| name.starts_with(|first: char| first.is_ascii_lowercase()))
        .map(str::to_owned)
        .collect()
}

#[test]
fn help_has_every_command() {
    let Output { status, stdout, stderr } = x(X, &["help"]).output().expect("bash is there");
    assert!(status.success() && stderr.is_empty());
    let help = String::from_utf8(stdout).expect("it is text");
    let told = help.lines().filter_map(|line| line.strip_prefix("./x ")?.split(' ').next());
    let mut told: BTreeSet<_> = told.map(str::to_owned).collect();
    told.insert("help".to_owned());
    assert!(told.len() > 20, "{told:?}");
    assert_eq!(commands(), told);
}

#[test]
fn a_command_that_is_none_gets_the_list() {
    for arguments in [&["simulate"][..], &["sim,"], &[""]] {
        let (status, text) = said(x(X, arguments));
        assert_eq!(status, Some(2));
        assert!(text.contains("./x sim [ARGS]"), "{text}");
        // Last, as the list is longer than a screen.
        let why = format!("x: there is no command {}: see above\n", arguments[0]);
        assert!(text.ends_with(&why), "{text}");
    }
}

#[test]
fn commands_without_arguments_take_none() {
    for name in ["test", "build", "stacks", "tutorial", "setup", "page"] {
        let (status, text) = said(x(X, &[name, "--now"]));
        assert_eq!((status, &*text), (Some(2), &*format!("x: {name} takes no arguments\n")));
    }
}

/// Without this check a mistyped `--check` would make the pictures anew.
#[test]
fn commands_with_one_option_take_no_other() {
    for (name, option) in [("picture", "--check"), ("coverage", "--accept")] {
        for wrong in [&["--now"][..], &[option, option], &[""]] {
            let (status, text) = said(x(X, &[&[name], wrong].concat()));
            assert_eq!((status, text), (Some(2), format!("x: {name} takes nothing, or {option}\n")));
        }
        for right in [&[name][..], &[name, option]] {
            let (_, text) = said(x(X, right));
            assert!(text.contains("no-such-program"), "it goes on with the set-up: {text}");
        }
    }
}

#[test]
fn a_number_of_inputs_and_a_package_have_to_be_such() {
    let says = |arguments: &[&str], needs: &str| {
        let (status, text) = said(x(X, arguments));
        assert_eq!(status, Some(1));
        assert!(text.starts_with(&format!("x: {} needs", arguments[0])) && text.contains(needs), "{text}");
    };
    says(&["fuzz", "many"], "a number of inputs");
    says(&["fuzz", "1000", "more"], "a number of inputs");
    says(&["fuzz", "4294967297"], "up to 999999999");
    says(&["mutants"], "kernel|tasks|hormone");
    says(&["mutants", "board"], "kernel|tasks|hormone");
}

/// avrdude's `-n` forbids writing. `x` must not write fuses in spite of it.
#[test]
fn to_flash_takes_an_mcu_a_port_a_programmer_and_nothing_else() {
    for arguments in [
        &["flash"][..],
        &["flash", "master"],
        &["flash", "both", "/dev/null"],
        &["flash", "slave", "/dev/null", ""],
        &["flash", "master", "/dev/null", "usbasp", "-n"],
    ] {
        let needs = "x: flash needs: master|slave PORT [PROGRAMMER], and nothing else\n";
        assert_eq!(said(x(X, arguments)), (Some(1), needs.to_owned()));
    }
    let (_, text) = said(x(X, &["flash", "master", "/dev/null", "usbasp"]));
    assert!(text.contains("no-such-program"), "it goes on with the set-up: {text}");
}

#[test]
fn a_toolchain_that_is_not_there_is_named() {
    assert_eq!(
        said(x(X, &["setup"])),
        (Some(1), "x: SUPERBOT_AVR_CARGO names no-such-program, which is not a program\n".to_owned())
    );
}

#[test]
fn a_folder_without_mujoco_is_named() {
    let folder = folder("mujoco");
    let programs = set_up_for(&folder, "exit 0");
    let mut command = x_set_up(&copy(&folder, "here"), &["setup"], &programs);
    command.env("SUPERBOT_MUJOCO", &folder);
    let why = format!("x: SUPERBOT_MUJOCO names {}, which has no {}\n", folder.display(), mujoco());
    assert_eq!(said(command), (Some(1), why));
}

#[test]
fn a_blank_in_a_path_is_refused_wherever_it_is_called_from() {
    let folder = folder("blank");
    let (status, text) = said(x(copy(&folder, "a blank"), &["setup"]));
    assert_eq!(status, Some(1));
    assert!(text.contains("a blank\" has a blank") && text.contains("move it"), "{text}");
    let mut elsewhere = x(copy(&folder, "none"), &["setup"]);
    elsewhere.env("CARGO_TARGET_DIR", "/tmp/to a target");
    let (status, text) = said(elsewhere);
    assert_eq!(status, Some(1));
    assert!(text.starts_with("x: \"/tmp/to a target\" has a blank"), "{text}");
}

#[test]
fn it_goes_to_its_own_folder_whatever_cdpath_says() {
    let folder = folder("cdpath");
    copy(&folder, "here");
    copy(&folder, "a trap/here");
    let mut command = x("here/x", &["setup"]);
    command.current_dir(&folder).env("CDPATH", folder.join("a trap"));
    let (_, text) = said(command);
    assert!(text.contains("no-such-program"), "it went elsewhere: {text}");
}

/// From where the link lies it would fetch MuJoCo into that folder, and then build nothing.
#[test]
fn it_goes_to_the_folder_that_a_link_to_it_leads_to() {
    let folder = folder("link");
    let here = copy(&folder, "here");
    let link = folder.join("a blank/x");
    fs::create_dir(folder.join("a blank")).expect("a folder can be made");
    symlink(here, &link).expect("a link can be made");
    let (_, text) = said(x(link, &["setup"]));
    assert!(text.contains("no-such-program"), "it stayed with the link: {text}");
}

/// Writes a shell script into a file, as a program.
fn write_program(path: &Path, script: &str) {
    fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("a folder can be made");
    fs::write(path, format!("#!/bin/sh\n{script}\n")).expect("a program can be written");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("and made one");
}

/// A folder with all programs that the set-up looks for, but neither gdb nor apt-get. Its `cargo` runs this
/// script.
fn set_up_for(folder: &Path, cargo: &str) -> PathBuf {
    let programs = folder.join("programs");
    for name in ["cargo", "cc", "make", "pkg-config", "avr-gcc", "avr-objcopy"] {
        let says = match name {
            "avr-gcc" => "echo /libc",
            "cargo" => cargo,
            _ => "exit 0",
        };
        write_program(&programs.join(name), says);
    }
    for name in ["bash", "cmp", "dirname", "mkdir", "sed"] {
        let path = std::env::var_os("PATH").expect("there is one");
        let places = std::env::split_paths(&path).map(|place| place.join(name));
        let place = places.into_iter().find(|place| place.exists()).expect("it is there");
        symlink(place, programs.join(name)).expect("a link can be made");
    }
    fs::write(programs.join(mujoco()), "").expect("a file can be written");
    programs
}

/// The name of MuJoCo's library, of the version that `x` pins.
fn mujoco() -> String {
    let text = fs::read_to_string(X).expect("x is there");
    let version = text.lines().find_map(|line| line.strip_prefix("mujoco_version="));
    format!("libmujoco.so.{}", version.expect("x pins it"))
}

/// The environment is that of a shell that was started before rustup put its folder into the path.
#[test]
fn cargo_is_found_in_its_own_folder_by_all_that_call_it() {
    let folder = folder("cargo");
    write_program(&folder.join("home/bin/cargo"), "echo $1 is called >&2");
    write_program(&folder.join("home/bin/rustc"), "exit 0");
    let programs = set_up_for(&folder, "");
    fs::remove_file(programs.join("cargo")).expect("it was there");
    write_program(&programs.join("c++"), "exit 0");
    let here = copy(&folder, "here");
    for (arguments, calls) in [
        (&["console", "/dev/null"][..], "run"),
        (&["mutants", "kernel"], "install"),
        (&["fuzz", "1"], "build"),
        (&["report", "none"], "run"),
    ] {
        let mut command = x(&here, arguments);
        command.env("PATH", &programs).env("CARGO_HOME", folder.join("home"));
        command
            .env("SUPERBOT_AVR_CARGO", "cargo")
            .env("SUPERBOT_MUJOCO", &programs)
            .env("LIBCLANG_PATH", "there");
        let (_, text) = said(command);
        assert!(text.contains(&format!("{calls} is called")), "{arguments:?}: {text}");
    }
}

/// Debian 12 has 1.65, which only says that a line of Cargo.toml is wrong.
#[test]
fn a_cargo_that_is_too_old_is_told() {
    let folder = folder("old");
    let programs = set_up_for(&folder, "echo cargo 1.65.0");
    let here = copy(&folder, "here");
    for arguments in [&["sim"][..], &["console", "/dev/null"], &["setup"]] {
        let (status, text) = said(x_set_up(&here, arguments, &programs));
        assert_eq!(status, Some(1));
        let needs = format!("{} or later is needed", env!("CARGO_PKG_RUST_VERSION"));
        assert!(text.starts_with("x: cargo is of Rust 1.65") && text.contains(&needs), "{text}");
    }
    for other in ["echo cargo 1.88.0", "echo cargo 2.0.0", "exit 1"] {
        write_program(&programs.join("cargo"), other);
        assert_eq!(said(x_set_up(&here, &["setup"], &programs)), (Some(0), String::new()), "{other}");
    }
}

/// Two that wrote into one folder would take each other's files away.
#[test]
fn what_two_want_is_fetched_once() {
    let folder = folder("fetch");
    let programs = set_up_for(&folder, "exit 0");
    let path = std::env::var("PATH").expect("there is one");
    let to = "while [ $1 != --dest ]; do shift; done; mkdir -p $2 && >$2/it.whl";
    let pip = format!("[ $3 = download ] || exit 0; {to} && echo fetched >&2 && sleep 1");
    write_program(&programs.join("python3"), &pip);
    let unzip = "for to; do case $to in *.so.*) library=$to; esac; done; mkdir $to/mujoco && >$to/$library";
    write_program(&programs.join("unzip"), unzip);
    let here = copy(&folder, "here");
    let start = || {
        let mut command = x_set_up(&here, &["setup"], &programs);
        command.env_remove("SUPERBOT_MUJOCO").env("PATH", format!("{}:{path}", programs.display()));
        command.stderr(Stdio::piped()).spawn().expect("bash is there")
    };
    let two = [start(), start()].map(|it| it.wait_with_output().expect("it ends"));
    let texts = two.each_ref().map(|it| String::from_utf8_lossy(&it.stderr));
    assert!(two.iter().all(|it| it.status.success()), "{texts:?}");
    assert_eq!(texts.iter().filter(|text| text.contains("fetched")).count(), 1, "{texts:?}");
}

/// As [`x`], with everything set up.
fn x_set_up(path: &Path, arguments: &[&str], programs: &Path) -> Command {
    let mut command = x(path, arguments);
    command.env("PATH", programs).env("SUPERBOT_AVR_CARGO", "cargo");
    command.env("SUPERBOT_MUJOCO", programs).env("LIBCLANG_PATH", "there");
    command
}

/// cargo-mutants exits with 3 if the tests of a mutant did not end, whether others were missed or not.
#[test]
fn mutants_that_no_test_finds_are_told_also_where_others_do_not_end() {
    let folder = folder("mutants");
    let cargo = r#"[ $1 = mutants ] || exit 0
        mkdir -p $3/mutants.out && printf "$MISSED" >$3/mutants.out/missed.txt && exit $STATUS"#;
    let programs = set_up_for(&folder, cargo);
    let here = copy(&folder, "here");
    for package in ["kernel", "tasks", "hormone"] {
        for (status, missed, ends) in [(0, "", 0), (3, "", 0), (2, "one", 1), (3, "one", 1), (4, "", 4)] {
            let mut command = x_set_up(&here, &["mutants", package], &programs);
            command.env("STATUS", status.to_string()).env("MISSED", missed);
            assert_eq!(said(command), (Some(ends), String::new()), "{package}, {status}, {missed}");
        }
    }
}

/// The program of an earlier build still exists: its output would come from other sources.
#[test]
fn what_does_not_compile_tells_no_figures() {
    let folder = folder("figures");
    let programs = set_up_for(&folder, "exit 101");
    let here = copy(&folder, "here");
    for bound in ["stack", "time"] {
        let program = folder.join(format!("here/target/debug/superbot-{bound}-bound"));
        write_program(&program, "echo kernel: 1 2 3 4");
    }
    for mcu in ["master", "slave"] {
        write_program(&folder.join(format!("here/target/images/firmware-{mcu}.elf")), "");
    }
    for arguments in [&["interrupts"][..], &["interrupts", "--json"], &["response", "--json"]] {
        let output = x_set_up(&here, arguments, &programs).output().expect("bash is there");
        let told = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(101), "{arguments:?}: {told}");
        assert!(!told.contains("kernel:"), "{arguments:?}: {told}");
    }
}

/// A user's Cargo configuration may name another folder for all builds. A relative one is below x.
#[test]
fn what_it_has_built_it_finds_wherever_cargo_builds() {
    let folder = folder("built");
    let to = "${CARGO_TARGET_DIR-$CARGO_BUILD_TARGET_DIR}";
    let programs = set_up_for(&folder, &format!("echo builds to {to} >&2"));
    let here = copy(&folder, "here");
    let root = folder.join("here").canonicalize().expect("it is there");
    for mcu in ["master", "slave"] {
        write_program(&root.join(format!("target/images/firmware-{mcu}.elf")), "");
    }
    let elsewhere = folder.join("elsewhere");
    for (named, is) in
        [(None, root.join("target")), (Some("there"), root.join("there")), (Some(""), root.join("target"))]
    {
        write_program(&is.join("debug/superbot-stack-bound"), &format!("echo by {} >&2", is.display()));
        let mut command = x_set_up(&here, &["stacks"], &programs);
        command
            .env("CARGO_BUILD_TARGET_DIR", &elsewhere)
            .envs(named.map(|named| ("CARGO_TARGET_DIR", named)));
        let one = format!("builds to {0}\nby {0}\n", is.display());
        assert_eq!(said(command), (Some(0), one.repeat(2)));
    }
}

/// Building the images of a sweep takes minutes.
#[test]
fn a_name_that_nobody_knows_is_refused_before_anything_is_built() {
    let folder = folder("names");
    let programs = set_up_for(&folder, "echo $* >&2; case $* in *' --check wrong') exit 2; esac");
    let here = copy(&folder, "here");
    for command in ["example", "sweep", "model", "faults"] {
        let (status, text) = said(x_set_up(&here, &[command, "wrong"], &programs));
        assert_eq!((status, text.lines().count()), (Some(2), 1), "{command}: {text}");
    }
}

/// `x` asks the simulator first, and the simulator then prints the error.
#[test]
fn an_option_that_the_simulator_does_not_take_is_refused_before_images_are_built() {
    let folder = folder("options");
    let is_asked = "case $* in *' --wrong --help') exit 2;; *--wrong) echo wrong >&2; exit 2;; esac";
    let programs = set_up_for(&folder, &format!("{is_asked}; echo cargo $* >&2"));
    let here = copy(&folder, "here");
    for command in ["sim", "terrain", "period", "campaign"] {
        let (status, text) = said(x_set_up(&here, &[command, "--wrong"], &programs));
        assert_eq!(status, Some(2), "{command}: {text}");
        assert_eq!(text, "cargo build --locked --release -p superbot-sim\nwrong\n", "{command}");
    }
}

#[test]
fn where_sizes_can_not_be_measured_the_file_stays_as_it_was() {
    let folder = folder("sizes");
    // Neither the tool that measures an image nor the one that computes its stacks exists.
    let programs = set_up_for(&folder, "exit 101");
    let here = copy(&folder, "here");
    for mcu in ["master", "slave"] {
        write_program(&folder.join(format!("here/target/images/firmware-{mcu}.elf")), "");
    }
    let file = folder.join("sizes.json");
    fs::write(&file, "as it was").expect("a file can be written");
    let (status, text) =
        said(x_set_up(&here, &["size", "--json", file.to_str().expect("it is text")], &programs));
    assert!(status.is_some_and(|status| status != 0), "{text}");
    assert_eq!(fs::read_to_string(&file).expect("it is there"), "as it was");
}

/// Debian's gdb is requested, unless the options name another one or wait for one.
#[test]
fn to_debug_takes_a_gdb_where_no_other_is_asked_for() {
    let folder = folder("gdb");
    let programs = set_up_for(&folder, "exit 0");
    let here = copy(&folder, "here");
    let gdb = |arguments: &[&str], named: Option<&str>| {
        let mut command = x_set_up(&here, &[&["gdb", "0.master"], arguments].concat(), &programs);
        command.env_remove("SUPERBOT_GDB").envs(named.map(|named| ("SUPERBOT_GDB", named)));
        said(command).1
    };
    for (arguments, named) in [
        (&["--gdb", "my-gdb"][..], None),
        (&["chain", "--gdb=my-gdb"], None),
        (&["--listen", "1234"], None),
        (&[], Some("my-gdb")),
    ] {
        assert_eq!(
            gdb(arguments, named),
            "x: there are no images yet: build them with ./x build\n",
            "it goes on: {arguments:?}"
        );
    }
    for arguments in [&[][..], &["--", "--gdb"]] {
        assert!(gdb(arguments, None).contains("gdb-avr: debugs an MCU"), "{arguments:?}");
    }
}

/// An empty variable names no gdb. `x` unsets it, also for the program that it calls.
#[test]
fn an_empty_name_of_a_gdb_is_none() {
    let folder = folder("empty");
    let programs = set_up_for(&folder, "echo gdb is ${SUPERBOT_GDB-unset} >&2");
    write_program(&programs.join("avr-gdb"), "exit 0");
    let here = copy(&folder, "here");
    let target = folder.join("here/target");
    write_program(&target.join("debug/superbot-stack-bound"), "exit 0");
    for mcu in ["master", "slave"] {
        for file in ["firmware-MCU.elf", "firmware-MCU.hex", "debug/firmware-MCU.hex"] {
            write_program(&target.join("images").join(file.replace("MCU", mcu)), "");
        }
    }
    for (named, is) in [("", "unset"), ("my-gdb", "my-gdb")] {
        let mut command = x_set_up(&here, &["gdb", "0.master"], &programs);
        command.env("SUPERBOT_GDB", named);
        let (status, text) = said(command);
        assert_eq!(status, Some(0), "{text}");
        assert_eq!(text.lines().last(), Some(&*format!("gdb is {is}")), "{text}");
    }
}
