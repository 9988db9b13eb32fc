//! All tests in simavr, in one program: it is linked once, and keeps its threads busy to the end.
//! `cargo test -p superbot-tests-simavr kernel::` runs those of one file.

mod agreement;
mod alone;
mod any_image;
mod bench;
mod board;
mod bridge;
mod canary;
mod concurrency;
mod console;
mod cores;
mod costs;
mod coverage;
mod cpu_time;
mod devices;
mod engines;
mod examples;
mod first_behaviour;
mod images;
mod kernel;
mod legs;
mod link;
mod loops;
mod memory;
mod model;
mod monitor;
mod motion;
mod period;
mod programs;
mod qemu;
mod reconfiguration;
mod response;
mod ring;
mod robot;
mod rules;
mod serial_load;
mod skips;
mod soft_uart;
mod stack;
mod stack_bound;
mod stack_check;
mod standing;
mod step;
mod storm;
mod sweep;
mod tick;
mod tickless;
mod time_bound;
mod trace;
mod turned;
mod watchdog;
mod world;

#[test]
fn every_file_of_tests_is_one_of_these() {
    let files = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests")).unwrap();
    for file in files {
        let name = file.unwrap().file_name().into_string().unwrap();
        let Some(module) = name.strip_suffix(".rs").filter(|&module| module != "main") else { continue };
        assert!(include_str!("main.rs").contains(&format!("mod {module};")), "{name}");
    }
}
