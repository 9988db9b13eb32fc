//! Sweeps the kernel with interrupts and tells what that finds; `--quick` tries a seventh of it.

use std::process::ExitCode;
use std::time::Instant;

use superbot_tests_simavr::sweep::{Extent, Findings, sweep_all};

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let extent = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => Extent::Whole,
        ["--quick"] => Extent::Sample(7),
        _ => {
            eprintln!("sweep takes no argument but --quick");
            return ExitCode::from(2);
        }
    };
    let start = Instant::now();
    let total = sweep_all(extent, |line| println!("{line}"));
    for (strikes, Findings { boundaries, runs, failed, .. }) in
        [("one strike", &total.single), ("two strikes", &total.pairs)]
    {
        println!("in all, {strikes}: {boundaries} boundaries, {runs} runs, {failed} failed");
    }
    println!("the longest that an interrupt waited: {} cycles", total.single.longest_wait);
    eprintln!("{:.0} s", start.elapsed().as_secs_f64());
    if total.single.failed + total.pairs.failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
