//! Runs an example in simavr and shows what it prints; without a name, lists the examples.

use std::process::ExitCode;

use superbot_tests_simavr::{arguments, examples};

fn main() -> ExitCode {
    let names = examples::names();
    match arguments().next() {
        None => println!("{}", names.join("\n")),
        Some(name) if names.contains(&name) => print!("{}", examples::run(&name)),
        Some(name) => {
            eprintln!("there is no example {name}; there are: {}", names.join(", "));
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}
