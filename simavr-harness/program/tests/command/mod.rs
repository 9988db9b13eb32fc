//! The program `superbot-sim` as a command, on the robot's images.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The directory in which `./x build` puts the robot's images.
pub fn images() -> PathBuf {
    std::env::var_os("SUPERBOT_IMAGES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/images"), PathBuf::from)
}

pub fn run(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_superbot-sim"));
    program.args(arguments).env("SUPERBOT_IMAGES", images()).output().expect("the program can be run")
}
