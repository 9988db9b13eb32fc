//! `sweep [--quick] [MCU]`: sweeps the kernel with interrupts and tells what that finds; `--quick` tries a seventh of it.

use std::process::ExitCode;
use std::time::Instant;

use superbot_tests_simavr::sweep::{Extent, Findings, sweep_all};
use superbot_tests_simavr::target::{ATMEGA128, TARGETS, Target};

fn main() -> ExitCode {
    let (mut extent, mut target) = (Extent::Whole, ATMEGA128);
    for argument in std::env::args().skip(1) {
        if argument == "--quick" {
            extent = Extent::Sample(7);
        } else if let Some(named) = Target::named(&argument) {
            target = named;
        } else {
            let known = TARGETS.map(|target| target.part.name).join(", ");
            eprintln!("sweep takes --quick and the name of an MCU ({known}), not {argument}");
            return ExitCode::from(2);
        }
    }
    let start = Instant::now();
    let total = sweep_all(target, extent, |line| println!("{line}"));
    for (strikes, Findings { boundaries, runs, failed, .. }) in
        [("one strike", &total.single), ("two strikes", &total.pairs)]
    {
        println!("in all, {strikes}: {boundaries} boundaries, {runs} runs, {failed} failed");
    }
    println!("the longest that an interrupt waited: {} cycles", total.single.longest_wait);
    eprintln!("{:.0} s", start.elapsed().as_secs_f64());
    if total.single.failed + total.pairs.failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
