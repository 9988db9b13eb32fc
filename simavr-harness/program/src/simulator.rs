//! The program behind `./x bench simulator`: the speed at which instructions are executed.

use std::error::Error;
use std::fmt;

use serde::Serialize;
use simavr_harness::bench::simulator::{self, Pace};

use super::arguments;
use super::json::{Destination, tell};

/// The number of runs of each program with each interpreter. Only the quickest counts, so that other load of
/// the machine matters less.
const ROUNDS: usize = 3;

/// Measures and prints.
pub fn run(options: &arguments::Bench, destination: Option<Destination>) -> Result<(), Box<dyn Error>> {
    tell(destination, &Report(simulator::measure(&options.images, ROUNDS)?))
}

#[derive(Serialize)]
#[serde(transparent)]
struct Report(Vec<Pace>);

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{:25}{:>9}  {:>18}  {:>21}  {:>21}  {:>5}  {:>21}",
            "program", "simulated", "instructions", "by the harness", "by simavr", "ratio", "by QEMU"
        )?;
        for pace in &self.0 {
            let millions = |number: f64| format!("{:.1} million", number / 1e6);
            let took = |seconds: f64| match pace.instructions {
                Some(number) => format!("{} a second", millions(number as f64 / seconds)),
                None => format!("{seconds:.3} s"),
            };
            let instructions = pace.instructions.map_or("-".into(), |number| millions(number as f64));
            writeln!(
                f,
                "{:25}{:>7.2} s  {instructions:>18}  {:>21}  {:>21}  {:>5.2}  {:>21}",
                pace.program,
                pace.simulated_seconds,
                took(pace.decoded_seconds),
                took(pace.simavr_seconds),
                pace.ratio(),
                pace.qemu_seconds.map_or("-".into(), took)
            )?;
        }
        Ok(())
    }
}
