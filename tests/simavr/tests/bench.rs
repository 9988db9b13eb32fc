//! No figure of the kernel gets worse, and flash counts either as the kernel's or as its program's.

use std::collections::BTreeMap;

use simavr_harness::Image;
use simavr_harness::bench::{self, Counted, simulator};
use superbot_tests_simavr::{images, test_images};

/// A line for each figure: its name, and the most that it may be.
const LIMITS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/expected/bench.txt");

#[test]
fn no_figure_gets_worse() {
    let measured = bench::measure(&test_images()).unwrap_or_else(|error| panic!("{error}"));
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        let lines = measured.iter().map(|measured| format!("{} {}\n", measured.name, measured.value));
        std::fs::write(LIMITS, lines.collect::<String>()).expect("the limits can be written");
        return;
    }
    let limits = std::fs::read_to_string(LIMITS)
        .unwrap_or_else(|error| panic!("{LIMITS}: {error}; UPDATE_EXPECTED=1 writes it"));
    let mut limits: BTreeMap<&str, u64> = limits.lines().map(limit).collect();
    let mut faults = Vec::new();
    for measured in measured {
        match limits.remove(measured.name) {
            None => faults.push(format!("{} is {}, and has no limit", measured.name, measured.value)),
            Some(limit) if measured.value > limit => {
                faults.push(format!("{} is {}, and was {limit}", measured.name, measured.value));
            }
            Some(_) => {}
        }
    }
    faults.extend(limits.keys().map(|name| format!("{name} is no longer measured")));
    assert!(faults.is_empty(), "{faults:#?}\nif that is meant, UPDATE_EXPECTED=1 writes the new figures");
}

#[test]
fn flash_is_the_kernels_or_the_programs() {
    let images = test_images();
    let measured = bench::measure(&images).unwrap_or_else(|error| panic!("{error}"));
    let length = |image: &str| {
        let image = Image::load(images.join(image).with_extension("elf"));
        image.unwrap_or_else(|error| panic!("{error}")).flash().len() as i64
    };
    let mut seen = 0;
    for measured in &measured {
        let Counted::Flash(flash) = &measured.counted else { continue };
        let (of_kernel, of_program) = (flash.of_kernel(), flash.of_program());
        assert_eq!(of_kernel + of_program, length(&flash.image) - length("bench_flash_empty"));
        let with_calls = if measured.name.ends_with("with_calls") { of_program } else { 0 };
        assert_eq!(measured.value as i64, of_kernel + with_calls, "{}", measured.name);
        assert!(
            flash.kernel.iter().any(|function| function.name == "__vector_15"),
            "the tick is the kernel's"
        );
        let body = format!("{}::body", flash.image);
        assert!(flash.program.iter().any(|function| function.name == body), "{body} is the program's");
        seen += 1;
    }
    assert_eq!(seen, 4);
}

fn limit(line: &str) -> (&str, u64) {
    let (name, value) = line.split_once(' ').expect("a line is a name and a figure");
    (name, value.parse().expect("a figure is a number"))
}

#[test]
fn the_simulators_speed_is_that_of_whole_programs() {
    let paces = simulator::measure(&images(), 1).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(paces.len(), 5);
    for pace in &paces {
        assert!(pace.ratio() > 0.0 && pace.ratio().is_finite(), "{pace:?}");
        assert!(pace.qemu_seconds.is_none_or(|seconds| seconds > 0.01), "{pace:?}");
        // These programs hardly sleep, and an instruction takes one cycle to five.
        let Some(instructions) = pace.instructions else { continue };
        let cycles = pace.simulated_seconds * f64::from(simulation::CLOCK_HZ);
        let each = cycles / instructions as f64;
        assert!((1.0..5.0).contains(&each), "{}: {each} cycles an instruction", pace.program);
    }
}
