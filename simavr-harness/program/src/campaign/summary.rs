//! Summarises a campaign's runs by all parameters but the seed.

use std::collections::HashMap;
use std::error::Error;
use std::fmt;

use serde_json::Value;

use super::results::{self, Outcome, Row, cell};
use super::statistics::{Mean, mean, wilson};

/// The figures of a summary: name in a report, heading in the table, and decimals in the table.
const FIGURES: [(&str, &str, usize); 4] = [
    ("hop_latency_us.mean", "hop, µs", 0),
    ("discovery_ms_max", "discovery, ms", 1),
    ("recovery_periods_max", "recovery, Periods", 2),
    ("distance_m", "distance, m", 2),
];

/// Runs that differ by their seeds only.
pub struct Combination {
    parameters: Row,
    runs: usize,
    /// The runs that have a report, and of these the runs with faults.
    done: usize,
    failed: usize,
    figures: Vec<Option<Mean>>,
}

/// All combinations, in the order in which they are run.
pub struct Summary(Vec<Combination>);

impl Summary {
    /// # Errors
    /// None: parameters can always be converted.
    pub fn of(outcomes: &[Outcome]) -> Result<Self, Box<dyn Error>> {
        let mut groups: Vec<(Row, Vec<&Outcome>)> = Vec::new();
        let mut group_of = HashMap::new();
        for outcome in outcomes {
            let parameters = parameters(outcome)?;
            let group = *group_of.entry(serde_json::to_string(&parameters)?).or_insert(groups.len());
            if group == groups.len() {
                groups.push((parameters, Vec::new()));
            }
            groups[group].1.push(outcome);
        }
        let combinations = groups.into_iter().map(|(parameters, group)| {
            let done: Vec<_> = group.iter().filter(|outcome| outcome.is_done()).collect();
            let rows: Vec<Row> = done.iter().map(|outcome| outcome.row()).collect::<Result<_, _>>()?;
            let figure = |(name, ..): (&str, &str, usize)| mean(&numbers(&rows, name));
            Ok(Combination {
                parameters,
                runs: group.len(),
                done: done.len(),
                failed: done.iter().filter(|outcome| outcome.has_failed()).count(),
                figures: FIGURES.map(figure).into(),
            })
        });
        combinations.collect::<Result<_, _>>().map(Summary)
    }

    /// A row for each combination.
    ///
    /// # Errors
    /// None: writing to memory does not fail.
    pub fn csv(&self) -> Result<String, Box<dyn Error>> {
        let rows: Vec<Row> = self.0.iter().map(Combination::row).collect();
        results::csv(&results::columns(&rows), &rows)
    }

    /// The parameters that are not the same in all combinations, and those that are.
    fn parameters(&self) -> (Vec<&String>, Vec<String>) {
        let Some(first) = self.0.first() else { return (Vec::new(), Vec::new()) };
        let varies =
            |name: &str| self.0.iter().any(|it| it.parameters.get(name) != first.parameters.get(name));
        let (varying, same): (Vec<_>, Vec<_>) = first.parameters.keys().partition(|name| varies(name));
        let same = same.into_iter().filter(|name| !cell(first.parameters.get(*name)).is_empty());
        (varying, same.map(|name| format!("{name} {}", cell(first.parameters.get(name)))).collect())
    }
}

/// The parameters of a run without its seed.
pub fn parameters(outcome: &Outcome) -> Result<Row, Box<dyn Error>> {
    let mut parameters = match serde_json::to_value(&outcome.run.parameters)? {
        Value::Object(parameters) => parameters,
        _ => Row::new(),
    };
    parameters.shift_remove("seed");
    Ok(parameters)
}

/// The values of a figure in the rows that have it.
pub fn numbers(rows: &[Row], name: &str) -> Vec<f64> {
    rows.iter().filter_map(|row| row.get(name)?.as_f64()).collect()
}

impl Combination {
    fn row(&self) -> Row {
        let mut row = self.parameters.clone();
        let [low, high] = wilson(self.failed, self.done);
        row.insert("runs".into(), self.runs.into());
        row.insert("done".into(), self.done.into());
        row.insert("failed".into(), self.failed.into());
        row.insert("failed_low".into(), low.into());
        row.insert("failed_high".into(), high.into());
        for ((name, ..), figure) in FIGURES.iter().zip(&self.figures) {
            let end = |sign: f64| figure.and_then(|it| Some(it.mean + sign * it.margin?));
            row.insert(format!("{name}.number"), figure.map_or(0, |it| it.number).into());
            row.insert(format!("{name}.mean"), figure.map(|it| it.mean).into());
            row.insert(format!("{name}.low"), end(-1.0).into());
            row.insert(format!("{name}.high"), end(1.0).into());
        }
        row
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (varying, same) = self.parameters();
        let told: Vec<usize> =
            (0..FIGURES.len()).filter(|&it| self.0.iter().any(|row| row.figures[it].is_some())).collect();
        writeln!(f, "{}\n", same.join(", "))?;
        let mut heading: Vec<&str> = varying.iter().map(|name| name.as_str()).collect();
        heading.extend(["runs", "failed", "of 100, 95 %"]);
        heading.extend(told.iter().map(|&figure| FIGURES[figure].1));
        writeln!(f, "| {} |", heading.join(" | "))?;
        writeln!(f, "|{}", "---|".repeat(heading.len()))?;
        for combination in &self.0 {
            let Combination { parameters, runs, done, failed, figures } = combination;
            let mut cells: Vec<String> = varying.iter().map(|&name| cell(parameters.get(name))).collect();
            let [low, high] = wilson(*failed, *done).map(|end| 100.0 * end);
            cells.push(if done == runs { runs.to_string() } else { format!("{done} of {runs}") });
            cells.extend([failed.to_string(), format!("{low:.1} to {high:.1}")]);
            cells.extend(told.iter().map(|&figure| show(figures[figure], FIGURES[figure].2)));
            writeln!(f, "| {} |", cells.join(" | "))?;
        }
        Ok(())
    }
}

fn show(figure: Option<Mean>, decimals: usize) -> String {
    match figure {
        None => String::new(),
        Some(Mean { mean, margin: None, .. }) => format!("{mean:.decimals$}"),
        Some(Mean { mean, margin: Some(margin), .. }) => format!("{mean:.decimals$} ± {margin:.decimals$}"),
    }
}
