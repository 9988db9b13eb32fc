//! `sweep [--check] [--quick] [MCU] [IMAGE...]`: sweeps the kernel with interrupts and prints the findings;
//! `--quick` tries a seventh of the boundaries. It sweeps all images, unless some are named. `--check` only
//! checks the arguments.

use std::process::ExitCode;
use std::time::Instant;

use superbot_tests_simavr::checked_arguments;
use superbot_tests_simavr::sweep::{Extent, Findings, PROGRAMS, sweep_all};
use superbot_tests_simavr::target::{ATMEGA128, TARGETS, Target};

fn main() -> ExitCode {
    let (mut extent, mut target) = (Extent::Whole, None);
    let mut programs = Vec::new();
    let (only_checks, arguments) = checked_arguments();
    for argument in arguments {
        if argument == "--quick" {
            extent = Extent::Sample(7);
        } else if let Some(named) = Target::named(&argument).filter(|_| target.is_none()) {
            target = Some(named);
        } else if let Some(named) = PROGRAMS.iter().find(|program| program.image == argument) {
            programs.push(named);
        } else {
            let known = TARGETS.map(|target| target.part.name).join(", ");
            let images: Vec<_> = PROGRAMS.iter().map(|program| program.image).collect();
            let images = images.join(", ");
            eprintln!("sweep takes --quick, one MCU ({known}) and images ({images}), not {argument}");
            return ExitCode::from(2);
        }
    }
    if only_checks {
        return ExitCode::SUCCESS;
    }
    if programs.is_empty() {
        programs.extend(PROGRAMS);
    }
    let start = Instant::now();
    let total = sweep_all(target.unwrap_or(ATMEGA128), programs, extent, |line| println!("{line}"));
    for (interruptions, Findings { boundaries, runs, failed, .. }) in
        [("one interrupt", &total.single), ("two interrupts", &total.pairs)]
    {
        println!("in all, {interruptions}: {boundaries} boundaries, {runs} runs, {failed} failed");
    }
    println!("longest wait of an interrupt: {} cycles", total.single.longest_wait);
    eprintln!("{:.0} s", start.elapsed().as_secs_f64());
    if total.single.failed + total.pairs.failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
