//! Runs an example in simavr and shows what it prints; without a name, lists the examples.

use std::process::ExitCode;

use superbot_tests_simavr::{arguments, examples};

fn main() -> ExitCode {
    let names = examples::names();
    let asked: Vec<String> = arguments().collect();
    match &asked[..] {
        [] => println!("{}", names.join("\n")),
        [name] if names.contains(name) => print!("{}", examples::run(name)),
        [name] => return refuse(&format!("there is no example {name}; there are: {}", names.join(", "))),
        [name, more, ..] => return refuse(&format!("one example at a time: {name}, without {more}")),
    }
    ExitCode::SUCCESS
}

fn refuse(why: &str) -> ExitCode {
    eprintln!("{why}");
    ExitCode::from(2)
}
