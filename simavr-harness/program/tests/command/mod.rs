//! The program `superbot-sim` as a command, on the robot's images.

#![allow(dead_code, reason = "no test uses all")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The robot file of one that a tonne throws at a wall within a second.
pub const BREAKS_THE_WORLD: &str = "modules = 10\nshape = 'centipede'\n\
    [world]\nslope_degrees = 45\nfriction = 0\n\
    loads = [{ module = 0, kg = 1000 }]\n\
    walls = [{ from_m = [-4, -2], to_m = [-4, 2], height_mm = 500 }]\n";

/// Where `./x build` puts the robot's images.
pub fn images() -> PathBuf {
    std::env::var_os("SUPERBOT_IMAGES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/images"), PathBuf::from)
}

pub fn run(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_superbot-sim"));
    program.args(arguments).env("SUPERBOT_IMAGES", images()).output().expect("the program can be run")
}
