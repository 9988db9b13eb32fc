//! The names of faults on the command line.

#![cfg(unix)]

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::process::Command;

#[test]
fn a_fault_that_there_is_not_is_refused_before_anything_runs() {
    for name in [&b"no_such_fault"[..], b"\xff"] {
        let mut faults = Command::new(env!("CARGO_BIN_EXE_faults"));
        let output = faults.arg(OsStr::from_bytes(name)).output().expect("the program can be run");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.starts_with("there is no fault "), "{message}");
    }
}
