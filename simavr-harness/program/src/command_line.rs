//! The command line.

use clap::{Parser, Subcommand};

use super::arguments::{Bench, Gdb, Period, Response, Sim, Terrain};
use super::campaign::{Campaign, CampaignReport};
use super::plot::Plot;

/// Simulates SuperBot robots in simavr. Each module has two ATmega128s, which run the images that a real
/// module is flashed with.
#[derive(Parser)]
#[command(version)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
    /// Run a robot, show it live, and end with a summary.
    Sim(Sim),
    /// Run a centipede on slopes, steps and other ground and through mishaps, and print how far it walks.
    Terrain(Terrain),
    /// Run a centipede with several Periods, and print its speed and how far a charge takes it.
    Period(Period),
    /// Write a list of jobs, one for each combination of the options in a file.
    Campaign(Campaign),
    /// Print a summary of a campaign's results, and write the results as tables.
    Report(CampaignReport),
    /// Draw one of the plots in docs.
    Plot(Plot),
    /// Debug one MCU of a robot with gdb, forward and backward. The whole robot stops with it.
    Gdb(Gdb),
    /// Plot the worst-case load of the CPUs. The standard input is the output of `./x response --json`.
    Response(Response),
    /// Measure the kernel's figures, and print them beside those of other kernels.
    Bench(Bench),
}
