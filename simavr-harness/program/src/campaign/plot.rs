//! Plots a figure of a campaign against a parameter.

use std::error::Error;

use serde_json::Value;

use super::results::{self, Outcome, Row, cell};
use super::statistics::{mean, wilson};
use super::summary::{numbers, parameters};
use crate::chart::{Chart, Curve, Point};

/// The figure that is not one of a single run, but of many: how many of 100 failed.
const FAILED: &str = "failed";

/// Runs, grouped by the values of a parameter.
type Along = Vec<(f64, Vec<Row>)>;

/// The curves for `outcomes`. A curve has the runs that differ only by their seeds and the parameter, and its
/// points are means with the ends of their intervals.
///
/// # Errors
/// The parameter has no numbers, or no run has a number by the figure's name.
pub fn curves(outcomes: &[Outcome], figure: &str, against: &str) -> Result<Vec<Curve>, Box<dyn Error>> {
    let rows: Vec<Row> = outcomes.iter().map(Outcome::row).collect::<Result<_, _>>()?;
    const NUMBERS: [&str; 4] = ["loss", "modules", "seconds", "seed"];
    if !NUMBERS.contains(&against) {
        return Err(format!("--against {against}: give one of {}", NUMBERS.join(", ")).into());
    }
    if figure != FAILED && numbers(&rows, figure).is_empty() {
        let columns = results::columns(&rows);
        let mut names = vec![FAILED];
        names.extend(columns.iter().map(String::as_str).filter(|name| !numbers(&rows, name).is_empty()));
        return Err(format!(
            "--plot {figure}: no run has a number of that name: give one of {}",
            names.join(", ")
        )
        .into());
    }
    // By all other parameters, then by this one.
    let mut groups: Vec<(Row, Along)> = Vec::new();
    for (outcome, row) in outcomes.iter().zip(rows).filter(|(outcome, _)| outcome.is_done()) {
        let Some(x) = row.get(against).and_then(Value::as_f64) else { continue };
        let mut others = parameters(outcome)?;
        others.shift_remove(against);
        let known = groups.iter().position(|(before, _)| *before == others);
        let group = known.unwrap_or_else(|| {
            groups.push((others, Vec::new()));
            groups.len() - 1
        });
        let group = &mut groups[group].1;
        match group.iter_mut().find(|(before, _)| *before == x) {
            Some((_, rows)) => rows.push(row),
            None => group.push((x, vec![row])),
        }
    }
    let labels = labels(groups.iter().map(|(others, _)| others).collect());
    let curves = groups.into_iter().zip(labels).map(|((_, group), label)| {
        let mut points: Vec<_> = group.into_iter().filter_map(|(x, rows)| point(x, &rows, figure)).collect();
        points.sort_by(|one, other| one.x.total_cmp(&other.x));
        Curve { label, points }
    });
    Ok(curves.filter(|curve| !curve.points.is_empty()).collect())
}

/// For each of `groups`, the parameters that are not the same in all of them.
fn labels(groups: Vec<&Row>) -> Vec<String> {
    let varies = |name: &str| groups.iter().any(|group| group.get(name) != groups[0].get(name));
    let label = |group: &&Row| {
        let parts = group.iter().filter(|(name, _)| varies(name)).map(|(name, value)| match value {
            Value::String(text) => text.clone(),
            value => format!("{name} {}", cell(Some(value))),
        });
        parts.filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
    };
    groups.iter().map(label).collect()
}

fn point(x: f64, rows: &[Row], figure: &str) -> Option<Point> {
    if figure == FAILED {
        let failed = rows.iter().filter(|row| row.get("exit_status") != Some(&0.into())).count();
        let [low, high] = wilson(failed, rows.len()).map(|end| 100.0 * end);
        return Some(Point { x, y: 100.0 * failed as f64 / rows.len() as f64, low, high });
    }
    let mean = mean(&numbers(rows, figure))?;
    let margin = mean.margin.unwrap_or(0.0);
    Some(Point { x, y: mean.mean, low: mean.mean - margin, high: mean.mean + margin })
}

/// The plot as SVG, light or dark like the page that shows it.
///
/// # Errors
/// No run is done yet, or the plot can't be drawn.
pub fn plot(curves: &[Curve], figure: &str, against: &str) -> Result<String, Box<dyn Error>> {
    if curves.is_empty() {
        return Err("no run is done yet: there is nothing to plot".into());
    }
    let y = if figure == FAILED { "failed, of 100" } else { figure };
    Chart { x: against, y, curves, has_dots: true }.svg()
}
