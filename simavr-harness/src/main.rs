//! `superbot-sim`: runs a robot in simavr, shows it live, and says how it did.

mod program;

use std::process::ExitCode;

fn main() -> ExitCode {
    program::main()
}
