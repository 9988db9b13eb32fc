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

    /// Where the plot goes, as SVG.
    #[arg(value_name = "FILE")]
    svg: PathBuf,

    /// Threads to run on. They do not change what comes of it.
    #[arg(long, default_value_t = usual_threads(), value_parser = threads, allow_hyphen_values = true)]
    threads: usize,

    /// The directory with firmware-master.elf and firmware-slave.elf, as `./x build` leaves them.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    images: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// The three joints of a module as they turn by 30 degrees.
    Step,
    /// How long hormones take from the head of a chain of 30, by the hops to where they come.
    Hops,
    /// What takes the time of the CPUs of a module that walks.
    Cpu,
    /// How long the joints' control takes and interrupts wait in a busy module, and at most by what is
    /// computed, which comes by the standard input.
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
