//! `model [--check] [MCU...] [SEQUENCES] [SEED]`: plays so many random scripts of kernel calls on each MCU,
//! and compares them with the reference. The defaults are the robot's MCU, 100,000 sequences, and seed 0.
//! `--check` only checks the arguments.

use std::process::ExitCode;
use std::time::Instant;

use superbot_tests_simavr::checked_arguments;
use superbot_tests_simavr::model::{Campaign, Subject};
use superbot_tests_simavr::target::{ATMEGA128, TARGETS, Target};

fn main() -> ExitCode {
    let (mut targets, mut numbers) = (Vec::new(), Vec::new());
    let (only_checks, arguments) = checked_arguments();
    for argument in arguments {
        if let Some(target) = Target::named(&argument) {
            targets.push(target);
        } else if let (Ok(number), ..2) = (argument.parse(), numbers.len()) {
            numbers.push(number);
        } else {
            let known = TARGETS.map(|target| target.part.name).join(", ");
            eprintln!("model takes MCUs ({known}), a number of sequences and a seed, not {argument}");
            return ExitCode::from(2);
        }
    }
    if only_checks {
        return ExitCode::SUCCESS;
    }
    if targets.is_empty() {
        targets.push(ATMEGA128);
    }
    let sequences = numbers.first().copied().unwrap_or(100_000);
    let first_seed = numbers.get(1).copied().unwrap_or(0);
    let mut have_agreed = true;
    for subject in targets.into_iter().flat_map(Subject::all) {
        let start = Instant::now();
        let total = Campaign { first_seed, sequences }.run(&subject);
        total.failures.iter().for_each(|failure| println!("{failure}"));
        let without = subject.without().map_or(String::new(), |group| format!(" without {group:?}"));
        println!("{}{without}: {total}, from seed {first_seed}", subject.target().part.name);
        eprintln!("{:.0} s", start.elapsed().as_secs_f64());
        have_agreed &= total.failures.is_empty();
    }
    if have_agreed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
