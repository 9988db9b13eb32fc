//! What the commands take on the command line.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;
use simavr_harness::Variation;
use simavr_harness::bench::FIGURES;
use simulation::Shape;

use super::mcu_name::McuName;

/// The most threads that a robot runs on.
const MOST_THREADS: usize = 256;

#[derive(Args)]
pub struct Sim {
    /// Shape of the robot: centipede, chain, ring, four-legs, six-legs, cross or human; or a robot file
    /// (.toml).
    #[arg(default_value = "centipede", value_parser = source)]
    pub robot: Source,

    /// Engine that runs the robot. simavr executes the images cycle by cycle; host runs the behaviours and
    /// links natively.
    #[arg(long, default_value = "simavr")]
    pub engine: EngineName,

    /// Interpreter that executes the images' instructions: decoded, the harness's own, which decodes them
    /// once; or simavr, simavr's own, which is slower. Both give the same results. Default: decoded.
    #[arg(long)]
    pub core: Option<CoreName>,

    /// Physics of the robot. With ground, which is level, the robot has weight and moves; with none, each
    /// joint turns by itself. Default: ground; with --engine host: none.
    #[arg(long)]
    pub world: Option<WorldName>,

    /// Number of modules. Default: centipede 100, chain 5, ring 6, four-legs 8, six-legs 11, cross 5, human
    /// 6.
    #[arg(long, value_parser = modules, allow_hyphen_values = true)]
    pub modules: Option<usize>,

    /// Length of the run, in simulated seconds.
    #[arg(long, default_value = "20", value_parser = seconds, allow_hyphen_values = true)]
    pub seconds: f64,

    /// Probability that a frame between two modules is lost, in each direction.
    #[arg(long, default_value = "0", value_name = "P", value_parser = probability, allow_hyphen_values = true)]
    pub loss: f64,

    /// Vary an assumption about modules, independently for each module, by up to this percentage: mass,
    /// friction, torque, current, gear-friction or gear-inertia, as in mass=20%. With potentiometer=1%, vary
    /// how potentiometers sit on their shafts, by up to 1 % of their travel; with converter=0.2%, each
    /// reading of a converter, by up to 0.2 % of full scale. With backlash=0.3%, give each joint's gear that
    /// much backlash, in percent of potentiometers' travel; with hooks=50%, let latches miss every other dock
    /// that they reach. May be given several times.
    #[arg(long, value_name = "WHAT=PERCENT%")]
    pub vary: Vec<Variation>,

    /// Seed that alone determines everything random (SRAM at power-up, noise).
    #[arg(long, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Number of threads. It does not change the results. Default: one for each core, up to 256.
    #[arg(long, value_parser = threads, allow_hyphen_values = true)]
    pub threads: Option<usize>,

    /// Print one JSON object in place of the summary, to a file or to the standard output (-).
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Record the run as one HTML file. Any browser shows it, also without a network.
    #[arg(long, value_name = "FILE.html")]
    pub record: Option<PathBuf>,

    /// Show the running robot in a browser. The page also controls the run, and is open to this machine only.
    /// Without PORT, the page takes any free port.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0",
        conflicts_with_all = ["record", "trace"])]
    pub view: Option<u16>,

    /// Write a timeline of MCUs' tasks to a file, which ui.perfetto.dev shows. If the file's name ends in
    /// .vcd, write the levels of the MCUs' pins and buses instead.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,

    /// MCUs to trace: each a module's number and master or slave, as in 0.master,3.slave.
    #[arg(long, value_name = "MCUS", value_delimiter = ',', default_value = "0.master", requires = "trace")]
    pub trace_of: Vec<McuName>,

    /// Directory with firmware-master.elf and firmware-slave.elf, which `./x build` writes.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    pub images: PathBuf,
}

impl Sim {
    /// The interpreter that executes the images.
    pub fn core(&self) -> CoreName {
        self.core.unwrap_or(CoreName::Decoded)
    }

    /// The number of threads on which the robot runs.
    pub fn threads(&self) -> usize {
        self.threads.unwrap_or_else(usual_threads)
    }
}

#[derive(Args)]
pub struct Gdb {
    /// MCU to debug: the module's number and master or slave, as in 7.master.
    pub mcu: McuName,

    #[command(flatten)]
    pub sim: Sim,

    /// Time of the first stop, in simulated seconds since power-up.
    #[arg(long, default_value = "0", value_name = "SECONDS", value_parser = at, allow_hyphen_values = true)]
    pub at: f64,

    /// The gdb to start. Default: the one that SUPERBOT_GDB names, or else avr-gdb.
    #[arg(long, value_name = "PROGRAM", conflicts_with = "listen")]
    pub gdb: Option<PathBuf>,

    /// Start no gdb, but wait until one connects to this port of the loopback interface.
    #[arg(long, value_name = "PORT", conflicts_with = "gdb_arguments", allow_hyphen_values = true)]
    pub listen: Option<u16>,

    /// Further arguments for gdb, as in -- -batch -x FILE.
    #[arg(last = true, value_name = "ARGS")]
    pub gdb_arguments: Vec<OsString>,
}

impl Gdb {
    /// The gdb to start.
    pub fn program(&self) -> PathBuf {
        let named = || std::env::var_os("SUPERBOT_GDB").filter(|name| !name.is_empty()).map(PathBuf::from);
        self.gdb.clone().or_else(named).unwrap_or_else(|| "avr-gdb".into())
    }
}

/// What a table of runs of a centipede takes.
#[derive(Args)]
pub struct Centipede {
    /// Number of modules of the centipede.
    #[arg(long, default_value = "18", value_parser = modules, allow_hyphen_values = true)]
    pub modules: usize,

    /// Seed of everything random, as for sim.
    #[arg(long, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Number of threads, as for sim.
    #[arg(long, default_value_t = usual_threads(), value_parser = threads, allow_hyphen_values = true)]
    pub threads: usize,

    /// Print one JSON object in place of the table, to a file or to the standard output (-).
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Directory with firmware-master.elf and firmware-slave.elf, which `./x build` writes.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    pub images: PathBuf,
}

#[derive(Args)]
pub struct Terrain {
    #[command(flatten)]
    pub centipede: Centipede,

    /// Length of each run, in simulated seconds.
    #[arg(long, default_value = "20", value_parser = clap::value_parser!(u16).range(12..),
        allow_hyphen_values = true)]
    pub seconds: u16,
}

#[derive(Args)]
pub struct Period {
    #[command(flatten)]
    pub centipede: Centipede,

    /// Length of each run, in simulated seconds.
    #[arg(long, default_value = "19", value_parser = clap::value_parser!(u16).range(7..),
        allow_hyphen_values = true)]
    pub seconds: u16,

    /// Also plot the figures, to this file.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

#[derive(Args)]
pub struct Response {
    /// SVG file for the plot.
    #[arg(long, value_name = "FILE")]
    pub svg: PathBuf,
}

#[derive(Args)]
pub struct Bench {
    /// What to measure: kernel, the kernel's figures; module, a module's figures; concurrency, a module with
    /// tasks beside one with a single loop; simulator, the simulator's speed.
    #[arg(value_enum, default_value = "kernel")]
    pub subject: Subject,

    /// Simulated seconds for which module saturates a module, or for which each case of concurrency runs.
    /// Default: 60.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=86_400), allow_hyphen_values = true)]
    pub seconds: Option<u64>,

    /// Print one JSON object in place of the table, to a file or to the standard output (-).
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Instead of the table, print what makes up one figure: cycles by instruction, flash by function.
    #[arg(long, value_name = "FIGURE", conflicts_with = "json", value_parser = figure)]
    pub listing: Option<String>,

    /// Instead of the table, print each place where a test image masks interrupts, with the most cycles that
    /// they were masked.
    #[arg(long, conflicts_with_all = ["json", "listing"])]
    pub windows: bool,

    /// Also plot a module with tasks beside one with a single loop, to this file.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,

    /// Directory that holds the test images in its tests/, where `./x bench` writes them.
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

fn figure(name: &str) -> Result<String, String> {
    let names = FIGURES.map(|figure| figure.name);
    if names.contains(&name) {
        return Ok(name.into());
    }
    Err(format!("there is no such figure: give one of {}", names.join(", ")))
}

/// Rounds seconds down to a value for an option.
pub fn at_most(seconds: f64) -> f64 {
    (seconds * 1000.0).floor() / 1000.0
}

/// What is measured.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Subject {
    Kernel,
    Module,
    Simulator,
    Concurrency,
}
