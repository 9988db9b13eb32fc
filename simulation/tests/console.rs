//! The program `superbot-console`, as `./x console` runs it.

#![cfg(unix)]

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::process::{Command, Output};

/// The program with the arguments in `line`, which blanks separate.
fn console(line: &[u8]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_superbot-console"));
    let arguments = line.split(|&byte| byte == b' ').map(OsStr::from_bytes);
    program.args(arguments).output().expect("the program can be run")
}

#[test]
fn what_can_not_be_asked_for_is_refused_with_the_usage() {
    for line in [&b"-h"[..], b"/dev/null \xff", b"\xff cpu cpu"] {
        let output = console(line);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && message.starts_with("Usage: "), "{message}");
    }
}

#[test]
fn a_port_may_have_any_path() {
    let output = console(b"/no/such/port\xff");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("/no/such/port") && message.contains("No such file"), "{message}");
}
