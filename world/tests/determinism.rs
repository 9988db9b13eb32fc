//! Tests that a run is reproducible to the bit.

use std::env;
use std::process::Command;

use crate::common::{chain, hash, run};

/// The environment variable of a process that only prints its hash.
const TELLS: &str = "SUPERBOT_WORLD_TELLS";

/// The test whose processes these are.
const TEST: &str = "determinism::the_c_librarys_choice_of_functions_makes_no_difference";

/// The hash of a chain that has wound on the ground.
fn wound() -> u64 {
    wound_by([2.0, 5.0, 5.0])
}

/// Likewise, in the end by these volts.
fn wound_by(last: [f64; 3]) -> u64 {
    let mut world = chain(8);
    for volts in [[4.0, -2.0, -4.0], [-5.0, 3.0, 1.0], last] {
        run(&mut world, volts, 500);
    }
    hash(&world)
}

#[test]
fn a_run_that_is_repeated_is_the_same_and_another_is_not() {
    assert_eq!(wound(), wound());
    assert_ne!(wound(), wound_by([2.0, 5.0, 5.001]));
}

#[test]
fn the_c_librarys_choice_of_functions_makes_no_difference() {
    if env::var_os(TELLS).is_some() {
        println!("hash {:016x}", wound());
        return;
    }
    let told = |tunables: &str| {
        let output = Command::new(env::current_exe().unwrap())
            .args(["--exact", "--nocapture", TEST])
            .env(TELLS, "1")
            .env("GLIBC_TUNABLES", tunables)
            .output()
            .unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        text.lines().find_map(|line| line.split_once("hash ")).map(|(_, hash)| hash.to_owned())
    };
    let usual = told("");
    assert!(usual.is_some(), "the process tells its hash");
    // Without fused multiply-add, glibc selects other implementations of sin, cos, exp, pow.
    assert_eq!(usual, told("glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX2_Usable,-FMA_Usable"));
}
