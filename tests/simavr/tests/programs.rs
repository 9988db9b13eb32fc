//! The programs behind `./x example` and `./x sweep` refuse what they would ignore.

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
