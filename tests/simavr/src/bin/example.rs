//! `example [--check] [NAME]`: runs an example in simavr and prints its output; without a name, lists the
//! examples. `--check` only checks that the example exists.

use std::process::ExitCode;

use superbot_tests_simavr::{checked_arguments, examples};

fn main() -> ExitCode {
    let names = examples::names();
    let (only_checks, asked) = checked_arguments();
    match &asked[..] {
        [] if only_checks => {}
        [name] if only_checks && names.contains(name) => {}
        [] => println!("{}", names.join("\n")),
        [name] if names.contains(name) => print!("{}", examples::run(name)),
        [name] => return refuse(&format!("there is no example {name}; give one of {}", names.join(", "))),
        [name, more, ..] => return refuse(&format!("give one example at a time: {name}, without {more}")),
    }
    ExitCode::SUCCESS
}

fn refuse(why: &str) -> ExitCode {
    eprintln!("{why}");
    ExitCode::from(2)
}
