//! The program behind `./x bench concurrency`: compares tasks with one loop, as a table, as JSON, and as a
//! plot.

mod names;
mod plot;

use std::error::Error;
use std::fmt;

use serde::Serialize;
use simavr_harness::bench::concurrency::{self, Concurrency, Row};

use super::arguments;
use super::json::{Destination, tell};
use names::{name, title};

/// Measures and prints.
pub fn run(options: &arguments::Bench, destination: Option<Destination>) -> Result<(), Box<dyn Error>> {
    let svg = options.svg.as_deref();
    let svg = svg.map(|path| Destination::besides(destination.as_ref(), path, None, "--svg")).transpose()?;
    let figures = concurrency::measure(&options.images, options.seconds())?;
    let plotted = svg.map(|svg| svg.write_text(&plot::plot(&figures)?)).transpose();
    // The figures are printed even if the plot can't be written.
    tell(destination, &Report(figures))?;
    plotted.map(|_| ())
}

#[derive(Serialize)]
#[serde(transparent)]
struct Report(Concurrency);

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Concurrency { styles, cases, .. } = &self.0;
        write!(f, "{:36}", "")?;
        for program in styles {
            write!(f, "{:>10}", name(program.style))?;
        }
        writeln!(f)?;
        let mut line = |what: &str, value: fn(&concurrency::Program) -> String| {
            write!(f, "{what:36}")?;
            styles.iter().try_for_each(|program| write!(f, "{:>10}", value(program)))?;
            writeln!(f)
        };
        line("flash, bytes", |program| program.size.flash_bytes.to_string())?;
        line("  of it the kernel's code", |program| program.size.flash_of_kernel_bytes.to_string())?;
        line("RAM, bytes", |program| program.size.ram_bytes.to_string())?;
        line("  of it stacks", |program| program.size.stack_bytes.to_string())?;
        line("CPU at rest, %", |program| format!("{:.1}", program.cpu_at_rest_percent))?;
        line("lines of its own", |program| program.size.lines.to_string())?;
        line("lines of the four behaviours", |program| program.size.trial_lines.to_string())?;
        line("step of 30 degrees: overshoot, %", |program| format!("{:.1}", program.step_overshoot_percent))?;
        line("  off in the end, degrees", |program| format!("{:.2}", program.step_error_deg))?;
        line("back after babble, ms", |program| format!("{:.0}", program.babble_recovery_ms))?;
        writeln!(f)?;
        head(
            f,
            ["control: missed", "done, us", "strays", "bytes", "repeated", "hormones"],
            ["hop, us", "edges", "answer, us", "late, ms", "CPU", "resets"],
        )?;
        head(
            f,
            ["of periods", "at most", "degrees", "lost", "frames", "lost"],
            ["mean   at most", "lost", "mean   at most", "of 7   of 11", "%", ""],
        )?;
        cases.iter().try_for_each(|row| row_of(f, row))?;
        if cases.iter().any(|row| row.control_given_up) {
            writeln!(f, "\n* At the end the joints were no longer controlled.")?;
        }
        Ok(())
    }
}

/// Writes one of the two heading lines above the rows.
fn head(f: &mut fmt::Formatter, control: [&str; 6], rest: [&str; 6]) -> fmt::Result {
    let [missed, done, strays, bytes, repeated, hormones] = control;
    let [hop, edges, answer, late, cpu, resets] = rest;
    writeln!(
        f,
        "{:27} {missed:>16} {done:>8} {strays:>7} {bytes:>5} {repeated:>8} {hormones:>8} {hop:>15} {edges:>5} {answer:>15} \
         {late:>13} {cpu:>5} {resets:>6}",
        ""
    )
}

fn row_of(f: &mut fmt::Formatter, row: &Row) -> fmt::Result {
    let number = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.0}"));
    let count = |value: Option<u64>| value.map_or("-".into(), |value| value.to_string());
    writeln!(
        f,
        "{:20} {:6} {:>16} {:>8} {:>7.1} {:>5} {:>8} {:>8} {:>15} {:>5} {:>15} {:>13} {:>5.1} {:>6}",
        title(row.case),
        name(row.style),
        format!(
            "{} of {}{}",
            row.control_missed,
            row.control_periods,
            if row.control_given_up { "*" } else { " " }
        ),
        number(Some(row.control_done_us_max)),
        row.joint_strays_deg_max,
        count(row.bytes_lost),
        row.frames_repeated,
        count(row.hormones_lost),
        format!("{:>6} {:>8}", number(row.hop_us_mean), number(row.hop_us_max)),
        row.edges_unanswered,
        format!("{:>6} {:>8}", number(row.reaction_us_mean), number(row.reaction_us_max)),
        format!("{:>6.1} {:>6.1}", row.seven.late_ms_max, row.eleven.late_ms_max),
        row.cpu_percent,
        row.resets,
    )
}
