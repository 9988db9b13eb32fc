//! The command line.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use serde::Serialize;
use simavr_harness::Variation;
use simulation::Shape;

use super::campaign::{Campaign, CampaignReport};
use super::plot::Plot;
use super::trace::McuName;

/// The most threads that a robot runs on.
const MOST_THREADS: usize = 256;

/// Runs SuperBot robots in simavr: each module two ATmega128s with the images that a real one is flashed
/// with.
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
    /// Run a centipede on slopes, steps and other ground, and through mishaps, and print how far it comes.
    Terrain(Terrain),
    /// Run a centipede by several Periods, and print how fast it is, and how far a charge takes it.
    Period(Period),
    /// Write a list of jobs for all combinations of options that a file lists, for an engine to run.
    Campaign(Campaign),
    /// Print what came of a campaign's runs, and write it as tables.
    Report(CampaignReport),
    /// Plot a figure that docs show.
    Plot(Plot),
    /// Debug one MCU of a robot with gdb, the whole robot stopped meanwhile, forward and back.
    Gdb(Gdb),
    /// Plot what the CPUs are taken for in the worst case, as `./x response --json` tells it by the standard
    /// input.
    Response(Response),
    /// Measure the kernel's figures, and print them beside those of other kernels.
    Bench(Bench),
}

#[derive(Args)]
pub struct Sim {
    /// How the modules are joined: centipede, chain, ring, four-legs, six-legs, cross, human, or a robot
    /// file (.toml).
    #[arg(default_value = "centipede", value_parser = source)]
    pub robot: Source,

    /// What runs the robot: simavr its images, cycle by cycle; host the behaviours and links natively.
    #[arg(long, default_value = "simavr")]
    pub engine: EngineName,

    /// Which interpreter executes the images' instructions: decoded, that of the harness, which decodes them
    /// once; or simavr's own, which is slower. What happens is the same. Decoded, unless given.
    #[arg(long)]
    pub core: Option<CoreName>,

    /// What the robot is in: level ground, where it has weight and moves; or none, where each joint turns by
    /// itself. Ground, unless given; with --engine host none, unless it is asked for.
    #[arg(long)]
    pub world: Option<WorldName>,

    /// How many modules the robot has. Unless given: centipede 100, chain 5, ring 6, four-legs 8, six-legs
    /// 11, cross 5, human 6.
    #[arg(long, value_parser = modules, allow_hyphen_values = true)]
    pub modules: Option<usize>,

    /// How long to run, in simulated seconds.
    #[arg(long, default_value = "20", value_parser = seconds, allow_hyphen_values = true)]
    pub seconds: f64,

    /// Probability that a frame is lost on its way between two modules, each way.
    #[arg(long, default_value = "0", value_name = "P", value_parser = probability, allow_hyphen_values = true)]
    pub loss: f64,

    /// Vary what is assumed of modules, each for itself, by up to so much: mass, friction, torque, current,
    /// gear-friction, gear-inertia, as in mass=20%; or how potentiometers sit on their shafts, of their
    /// travel, as in potentiometer=1%. May be given several times.
    #[arg(long, value_name = "WHAT=PERCENT%")]
    pub vary: Vec<Variation>,

    /// What chance there is (SRAM at power-up, noise) follows from this number alone.
    #[arg(long, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Threads to run on. They do not change what happens. As many as the machine has cores, unless given.
    #[arg(long, default_value_t = usual_threads(), value_parser = threads, allow_hyphen_values = true)]
    pub threads: usize,

    /// Print one JSON object in place of the summary, to a file or to the standard output (-).
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Record the run as one HTML file, in which any browser shows it, also without a network.
    #[arg(long, value_name = "FILE.html")]
    pub record: Option<PathBuf>,

    /// Show the run as it goes on in a browser, by a page of this machine alone, which can have a say in it:
    /// at this port, or any that is free.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0",
        conflicts_with_all = ["record", "trace"])]
    pub view: Option<u16>,

    /// Write what MCUs' tasks did over time to a file, which ui.perfetto.dev shows; or, where it ends in
    /// .vcd, the levels of their pins and buses.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,

    /// Of which MCUs that is: modules' numbers, and master or slave, as in 0.master,3.slave.
    #[arg(long, value_name = "MCUS", value_delimiter = ',', default_value = "0.master", requires = "trace")]
    pub trace_of: Vec<McuName>,

    /// The directory with firmware-master.elf and firmware-slave.elf, as `./x build` leaves them.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    pub images: PathBuf,
}

impl Sim {
    /// The interpreter that executes the images.
    pub fn core(&self) -> CoreName {
        self.core.unwrap_or(CoreName::Decoded)
    }
}

#[derive(Args)]
pub struct Gdb {
    /// Which MCU: the module's number, and master or slave, as in 7.master.
    pub mcu: McuName,

    #[command(flatten)]
    pub sim: Sim,

    /// Stop first at so many simulated seconds, rather than at power-up.
    #[arg(long, default_value = "0", value_name = "SECONDS", value_parser = at, allow_hyphen_values = true)]
    pub at: f64,

    /// Which gdb is started.
    #[arg(long, value_name = "PROGRAM", env = "SUPERBOT_GDB", default_value = "avr-gdb")]
    pub gdb: PathBuf,

    /// Start no gdb, but wait for one at this port of the loopback interface.
    #[arg(long, value_name = "PORT", conflicts_with = "gdb_arguments", allow_hyphen_values = true)]
    pub listen: Option<u16>,

    /// What gdb is called with besides, as in -- -batch -x FILE.
    #[arg(last = true, value_name = "ARGS")]
    pub gdb_arguments: Vec<OsString>,
}

/// What a table of runs of a centipede takes.
#[derive(Args)]
pub struct Centipede {
    /// How many modules the centipede has.
    #[arg(long, default_value = "18", value_parser = modules, allow_hyphen_values = true)]
    pub modules: usize,

    /// As for sim.
    #[arg(long, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// As for sim.
    #[arg(long, default_value_t = usual_threads(), value_parser = threads, allow_hyphen_values = true)]
    pub threads: usize,

    /// Print one JSON object in place of the table, to a file or to the standard output (-).
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// The directory with firmware-master.elf and firmware-slave.elf, as `./x build` leaves them.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    pub images: PathBuf,
}

#[derive(Args)]
pub struct Terrain {
    #[command(flatten)]
    pub centipede: Centipede,

    /// How long each run takes, in simulated seconds.
    #[arg(long, default_value = "20", value_parser = clap::value_parser!(u16).range(12..),
        allow_hyphen_values = true)]
    pub seconds: u16,
}

#[derive(Args)]
pub struct Period {
    #[command(flatten)]
    pub centipede: Centipede,

    /// How long each run takes, in simulated seconds.
    #[arg(long, default_value = "19", value_parser = clap::value_parser!(u16).range(7..),
        allow_hyphen_values = true)]
    pub seconds: u16,

    /// Plot the figures, too, to this file.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

#[derive(Args)]
pub struct Response {
    /// The file for the plot.
    #[arg(long, value_name = "FILE")]
    pub svg: PathBuf,
}

#[derive(Args)]
pub struct Bench {
    /// What to measure: the kernel's figures, those of a module, how a module does with tasks and with one
    /// loop, or how fast the simulator is.
    #[arg(value_enum, default_value = "kernel")]
    pub subject: Subject,

    /// For how long a module is saturated, or each case of tasks against one loop runs, in simulated seconds:
    /// 60, unless given.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=86_400), allow_hyphen_values = true)]
    pub seconds: Option<u64>,

    /// Print one JSON object in place of the table, to a file or to the standard output (-).
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Print what makes up one figure instead: cycles instruction by instruction, flash function by function.
    #[arg(long, value_name = "FIGURE", conflicts_with = "json")]
    pub listing: Option<String>,

    /// Print instead each place where a test image masks interrupts, with the most cycles it did so.
    #[arg(long, conflicts_with_all = ["json", "listing"])]
    pub windows: bool,

    /// Plot how a module does with tasks and with one loop, too, to this file.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,

    /// The directory under which the test images lie in tests/, as `./x bench` leaves them.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    pub images: PathBuf,
}

impl Bench {
    /// The length of a run, in s.
    pub fn seconds(&self) -> u64 {
        self.seconds.unwrap_or(60)
    }
}

/// What runs a robot.
#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineName {
    Simavr,
    Host,
}

/// What executes an image's instructions.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CoreName {
    Decoded,
    Simavr,
}

/// What a robot is in.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WorldName {
    Ground,
    None,
}

/// What robot to run.
#[derive(Clone)]
pub enum Source {
    Shape(Shape),
    /// A robot file.
    File(PathBuf),
}

fn source(text: &str) -> Result<Source, String> {
    if text.ends_with(".toml") {
        return Ok(Source::File(text.into()));
    }
    let shape = Shape::ALL.into_iter().find(|shape| shape.name() == text);
    shape.map(Source::Shape).ok_or_else(|| {
        format!("give one of {}, or a robot file that ends in .toml", Shape::ALL.map(Shape::name).join(", "))
    })
}

pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

/// The number of threads on which a robot runs by default.
pub fn usual_threads() -> usize {
    cores().min(MOST_THREADS)
}

fn modules(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(modules @ 1..=1_000_000) => Ok(modules),
        _ => Err("give a number of modules from 1 to 1000000".into()),
    }
}

pub fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(threads @ 1..=MOST_THREADS) => Ok(threads),
        _ => Err(format!("give a number of threads from 1 to {MOST_THREADS}")),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.001..=86_400.0).contains(&seconds) => Ok(seconds),
        _ => Err("give a time from 0.001 to 86400 seconds".into()),
    }
}

fn at(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.0..=86_400.0).contains(&seconds) => Ok(seconds),
        _ => Err("give a time from 0 to 86400 seconds".into()),
    }
}

fn probability(text: &str) -> Result<f64, String> {
    match text.parse() {
        // -0 becomes 0: otherwise the two would be different runs of a campaign.
        Ok(probability) if (0.0..=1.0).contains(&probability) => Ok(f64::abs(probability)),
        _ => Err("give a probability from 0 to 1".into()),
    }
}

/// What is measured.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Subject {
    Kernel,
    Module,
    Simulator,
    Concurrency,
}
