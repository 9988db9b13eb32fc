//! `superbot-sim`: runs a robot in simavr or natively, shows it live, and reports how it did.
//!
//! It is behind `./x sim`, `./x terrain`, `./x period`, `./x campaign`, `./x report`, `./x plot`, `./x gdb`
//! and `./x bench`, and behind the plot of `./x response`.

mod arguments;
mod bench;
mod campaign;
mod chart;
mod closed;
mod command_line;
mod concurrency;
mod cost;
mod dark;
mod display;
mod gdb;
mod images;
mod json;
mod listing;
mod mcu_name;
mod module;
mod output;
mod period;
mod plot;
mod record;
mod report;
mod response;
mod scenario;
mod sim;
mod simulator;
mod summary;
mod table;
mod terrain;
mod trace;
mod view;

use std::process::ExitCode;

use clap::Parser;

use command_line::{Arguments, Command};

/// Exit status 0: the robot had no faults, or the figures are printed. 1: the robot had faults. 2: the
/// command could not be carried out.
fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Sim(options) => sim::run(&options),
        Command::Terrain(options) => terrain::run(&options).map(|()| true),
        Command::Period(options) => period::run(&options).map(|()| true),
        Command::Campaign(options) => campaign::run(&options),
        Command::Report(options) => campaign::report(&options).map(|()| true),
        Command::Plot(options) => plot::run(&options).map(|()| true),
        Command::Gdb(options) => gdb::run(&options),
        Command::Response(options) => response::run(&options).map(|()| true),
        Command::Bench(options) => bench::run(&options).map(|()| true),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            output::say(format_args!("superbot-sim: {error}\n"));
            ExitCode::from(2)
        }
    }
}
