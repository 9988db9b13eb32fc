//! Gives the linker of a program for the AVR some checks, which take no flash.
//!
//! GNU ld reads a library that is text as a part of its script, and Cargo names a library to the linker of
//! each program that uses this crate. `DEFINED` is true only for symbols of the program, and not for those of
//! the script.

use std::path::Path;
use std::{env, fs, io};

/// The highest vector of any AVR.
const LAST_VECTOR: u32 = 127;

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "avr") {
        let folder = env::var("OUT_DIR").map_err(io::Error::other)?;
        fs::write(Path::new(&folder).join("libkernel_checks.a"), checks())?;
        println!("cargo::rustc-link-search=native={folder}");
        println!("cargo::rustc-link-lib=dylib=kernel_checks");
    }
    Ok(())
}

fn checks() -> String {
    let vectors = (1..=LAST_VECTOR).map(|number| {
        // The table of vectors, 4 bytes each, ends there.
        let exists = format!("__trampolines_start - __vectors > 4 * {number}");
        check(&format!("__vector_{number}"), &exists, &format!("this MCU has no vector {number}"))
    });
    // The kernel's instructions come next behind all tables.
    let tables = check(
        "kernel_switch",
        "kernel_switch <= 0x10000",
        "the tables of kernel::flash! reach beyond the low 64 KB of flash",
    );
    // The data space is at 0x800000 for the linker. A link tells an object from a number by its address.
    let variables = check(
        "kernel_switch",
        "__data_start >= 0x800100 && __stack < 0x8000",
        "the kernel needs an MCU whose SRAM begins at 0x100 or above and ends below 0x8000",
    );
    vectors.chain([tables, variables]).collect()
}

/// Checks that `condition` holds if the program has `symbol`.
fn check(symbol: &str, condition: &str, message: &str) -> String {
    format!("ASSERT(DEFINED({symbol}) ? {condition} : 1, \"{message}\")\n")
}
