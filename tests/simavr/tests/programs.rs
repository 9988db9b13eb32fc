//! The programs behind `./x example`, `./x sweep` and `./x model` refuse arguments that they would ignore.

use std::process::Command;

#[track_caller]
fn refuses(program: &str, arguments: [&str; 2]) {
    let output = Command::new(program).args(arguments).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains(arguments[1]), "{said}");
}

#[test]
fn an_argument_too_many_is_refused() {
    refuses(env!("CARGO_BIN_EXE_example"), ["fifos", "mutexes"]);
    refuses(env!("CARGO_BIN_EXE_sweep"), ["atmega328p", "atmega2560"]);
}

#[test]
fn what_they_take_can_be_asked_for_before_images_are_built() {
    for (program, takes) in [
        (env!("CARGO_BIN_EXE_example"), "fifos"),
        (env!("CARGO_BIN_EXE_sweep"), "sweep_queue"),
        (env!("CARGO_BIN_EXE_model"), "atmega2560"),
    ] {
        refuses(program, ["--check", "wrong"]);
        for arguments in [&["--check", takes][..], &["--check"]] {
            let output = Command::new(program).args(arguments).env("SUPERBOT_IMAGES", "/none").output();
            let output = output.expect("it runs");
            let is_silent = output.stdout.is_empty() && output.stderr.is_empty();
            assert!(output.status.success() && is_silent, "{program}: {output:?}");
        }
    }
}
