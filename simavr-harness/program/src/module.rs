//! The program behind `./x bench module`: the module's figures, and their limits.

use std::error::Error;
use std::fmt;

use serde::Serialize;
use simavr_harness::bench::module::{self, ModuleFigures};

use super::arguments;
use super::json::{Destination, tell};

/// Measures and prints.
pub fn run(options: &arguments::Bench, destination: Option<Destination>) -> Result<(), Box<dyn Error>> {
    let report = Report(module::measure(&options.images, options.seconds())?);
    tell(destination, &report)
}

#[derive(Serialize)]
#[serde(transparent)]
struct Report(ModuleFigures);

/// The limit of a figure.
#[derive(Clone, Copy)]
enum Aim {
    AtMost(f64),
    AtLeast(f64),
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        use Aim::{AtLeast, AtMost};
        let figures = &self.0;
        for (name, value, aim) in [
            ("pid_jitter_us_max", figures.pid_jitter_us_max, AtMost(20.0)),
            ("pid_missed", figures.pid_missed as f64, AtMost(0.0)),
            ("step_overshoot_percent", figures.step_overshoot_percent, AtMost(5.0)),
            ("step_error_deg", figures.step_error_deg, AtMost(0.3)),
            ("soft_uart_errors", figures.soft_uart_errors as f64, AtMost(0.0)),
            ("link_efficiency_0", figures.link_efficiency_0, AtLeast(0.9)),
            ("link_efficiency_1e4", figures.link_efficiency_1e4, AtLeast(0.9)),
            ("link_efficiency_1e3", figures.link_efficiency_1e3, AtLeast(0.9)),
            ("link_violations", figures.link_violations as f64, AtMost(0.0)),
            ("bridge_efficiency", figures.bridge_efficiency, AtLeast(0.8)),
            ("cpu_idle", figures.cpu_idle, AtMost(0.08)),
            ("cpu_saturated", figures.cpu_saturated, AtMost(0.6)),
            ("babble_pid_missed", figures.babble_pid_missed as f64, AtMost(0.0)),
            ("babble_recovery_ms", figures.babble_recovery_ms, AtMost(300.0)),
            ("watchdog_recovery_ms", figures.watchdog_recovery_ms, AtMost(500.0)),
            ("walking_pid_jitter_us_max", figures.walking_pid_jitter_us_max, AtMost(20.0)),
            ("walking_pid_missed", figures.walking_pid_missed as f64, AtMost(0.0)),
            ("standing_error_deg", figures.standing_error_deg, AtMost(0.3)),
        ] {
            let (sign, limit, is_reached) = match aim {
                AtMost(limit) => ("<=", limit, value <= limit),
                AtLeast(limit) => (">=", limit, value >= limit),
            };
            let verdict = if is_reached { "reached" } else { "MISSED" };
            writeln!(f, "{name:25}{value:>8.3}  {sign} {limit:<5} {verdict}")?;
        }
        Ok(())
    }
}
