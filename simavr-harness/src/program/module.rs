//! The program behind `./x bench module`: the module's figures, and what they should reach.

use std::error::Error;
use std::fmt;

use serde::Serialize;
use simavr_harness::bench::module::{self, ModuleFigures};

use super::{arguments, json};

/// Measures and prints.
pub fn run(options: &arguments::Bench) -> Result<(), Box<dyn Error>> {
    let report = Report(module::measure(&options.images, options.seconds)?);
    match &options.json {
        Some(path) => json::write(&report, path)?,
        None => print!("{report}"),
    }
    Ok(())
}

#[derive(Serialize)]
#[serde(transparent)]
struct Report(ModuleFigures);

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let figures = &self.0;
        for (name, value, limit) in [
            ("pid_jitter_us_max", figures.pid_jitter_us_max, 20.0),
            ("pid_missed", figures.pid_missed as f64, 0.0),
            ("step_overshoot_percent", figures.step_overshoot_percent, 5.0),
            ("step_error_deg", figures.step_error_deg, 0.3),
            ("cpu_idle", figures.cpu_idle, 0.08),
            ("cpu_saturated", figures.cpu_saturated, 0.6),
        ] {
            let verdict = if value <= limit { "reached" } else { "MISSED" };
            writeln!(f, "{name:25}{value:>8.3}  <= {limit:<5} {verdict}")?;
        }
        Ok(())
    }
}
