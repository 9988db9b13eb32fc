//! `./x plot`: the plots in docs, each from a run of its own.

mod cpu;
mod hops;
mod response;
mod step;

use std::error::Error;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::arguments::{threads, usual_threads};
use super::json::Destination;

#[derive(Args)]
pub struct Plot {
    /// What to plot.
    #[arg(value_enum)]
    what: What,

    /// SVG file for the plot.
    #[arg(value_name = "FILE")]
    svg: PathBuf,

    /// Number of threads. It does not change the plot.
    #[arg(long, default_value_t = usual_threads(), value_parser = threads, allow_hyphen_values = true)]
    threads: usize,

    /// Directory with firmware-master.elf and firmware-slave.elf, which `./x build` writes.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    images: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// The angles of a module's three joints while they turn by 30 degrees.
    Step,
    /// The time that hormones take from the head of a chain of 30 modules, against the number of hops.
    Hops,
    /// How tasks and interrupts share the time of the CPUs of a walking module.
    Cpu,
    /// How long the joints' control takes and interrupts wait in a busy module, beside their computed bounds.
    /// The standard input is the output of `./x response --json`.
    Response,
}

pub fn run(options: &Plot) -> Result<(), Box<dyn Error>> {
    let destination = Destination::file(&options.svg, None, "FILE")?;
    let svg = match options.what {
        What::Step => step::plot(&options.images)?,
        What::Hops => hops::plot(&options.images, options.threads)?,
        What::Cpu => cpu::plot(&options.images, options.threads)?,
        What::Response => response::plot(&options.images, &mut std::io::stdin())?,
    };
    destination.write_text(&svg)
}
