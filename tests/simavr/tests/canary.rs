//! The same computations have the same results on the AVR and on the host, at every optimisation level and
//! with interrupts at any place.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use simavr_harness::{Image, Mcu, Pin, State};
use superbot_tests_simavr::marks::values;
use superbot_tests_simavr::{images, mcu};

/// The pin whose interrupt wakes the task above the one that computes.
const BUTTON: Pin = Pin { port: 'E', bit: 4 };

/// Cycles between interrupts: a prime, so that they occur everywhere.
const BETWEEN: u64 = 1009;

/// More cycles than any of these images needs.
const LIMIT: u64 = 100_000_000;

#[test]
fn the_avr_computes_what_the_host_computes() {
    for image in ["canary-s/canary", "canary-z/canary", "canary-3/canary"] {
        assert_eq!(differing(image), BTreeSet::new(), "{image}");
    }
}

#[test]
fn a_difference_is_found() {
    assert_eq!(differing("canary-s-fault-shift/canary"), BTreeSet::from(["sign i16"]));
}

/// That function would overwrite two bytes of the stack (docs/toolchain.md).
#[test]
fn no_image_multiplies_i32_with_a_check_for_overflow() {
    let programs: Vec<_> = programs(&images());
    assert!(programs.len() > 20, "{programs:?}");
    for program in programs {
        let image = Image::load(&program).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(image.symbol("__mulosi4"), None, "{}", program.display());
    }
}

/// With it the size of a program would depend on where it was built (docs/toolchain.md).
#[test]
fn no_image_has_debugging_information() {
    let mut programs = programs(&images());
    programs.retain(|program| !program.starts_with(images().join("debug"))); // for gdb, by another linker
    assert!(programs.len() > 20, "{programs:?}");
    for program in programs {
        let bytes = std::fs::read(&program).unwrap_or_else(|error| panic!("{}: {error}", program.display()));
        let producer = b"clang LLVM (rustc"; // rustc's information; that of avr-libc's code never changes
        assert!(!bytes.windows(producer.len()).any(|bytes| bytes == producer), "{}", program.display());
    }
}

/// The programs in a directory and those below it.
fn programs(directory: &Path) -> Vec<PathBuf> {
    let entries = directory.read_dir().unwrap_or_else(|error| panic!("{}: {error}", directory.display()));
    let paths = entries.map(|entry| entry.expect("it can be listed").path());
    let (directories, files): (Vec<_>, Vec<_>) = paths.partition(|path| path.is_dir());
    let elves = files.into_iter().filter(|path| path.extension().is_some_and(|extension| extension == "elf"));
    elves.chain(directories.iter().flat_map(|directory| programs(directory))).collect()
}

/// The checks whose digests differ between the image and the host.
fn differing(image: &str) -> BTreeSet<&'static str> {
    let mut expected = Vec::new();
    canary::run(|name, digest| expected.push((name, digest)));
    let mut mcu = mcu(image);
    run_with_interrupts(&mut mcu);
    let marks = values(mcu.markers());
    let (digests, []) = marks.as_chunks() else { panic!("{image}: a part of a digest: {marks:?}") };
    let last = expected.get(digests.len()).map_or("the last check", |(name, _)| name);
    assert_eq!(mcu.state(), State::Done, "{image}: does not end; it is in \"{last}\"");
    assert_eq!(digests.len(), expected.len(), "{image}: ends in \"{last}\"");
    let woken = mcu.read_symbol("WOKEN").expect("the image counts");
    let woken = u16::from_le_bytes(woken.try_into().expect("a count has two bytes"));
    assert!(woken > 10_000, "{image}: {woken} interrupts");
    let digests = digests.iter().copied().map(u32::from_le_bytes);
    digests.zip(expected).filter(|(seen, (_, digest))| seen != digest).map(|(_, (name, _))| name).collect()
}

/// Runs to the end, with an interrupt every [`BETWEEN`] cycles.
fn run_with_interrupts(mcu: &mut Mcu) {
    while mcu.is_alive() && mcu.cycle() < LIMIT {
        mcu.run_until(mcu.cycle() + BETWEEN);
        mcu.drive_pin(BUTTON, true);
        mcu.drive_pin(BUTTON, false);
    }
}
