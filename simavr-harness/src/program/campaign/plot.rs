//! A figure of a campaign against a parameter, as a plot.

use std::error::Error;

use plotters::prelude::*;
use serde_json::Value;

use super::results::{self, Outcome, Row, cell};
use super::statistics::{mean, wilson};
use super::summary::{numbers, parameters};
use crate::program::dark::for_any_page;

/// The figure that is no run's, but of many: how many of 100 failed.
const FAILED: &str = "failed";

const COLOURS: [RGBColor; 6] = [
    RGBColor(9, 105, 218),
    RGBColor(207, 34, 46),
    RGBColor(26, 127, 55),
    RGBColor(130, 80, 223),
    RGBColor(154, 103, 0),
    RGBColor(87, 96, 106),
];

/// Runs that differ by their seeds and the parameter only.
pub struct Series {
    label: String,
    points: Vec<Point>,
}

/// Runs by the values of a parameter.
type Along = Vec<(f64, Vec<Row>)>;

/// A mean over seeds, with the ends of its interval.
struct Point {
    x: f64,
    mean: f64,
    low: f64,
    high: f64,
}

/// What is to be plotted of `outcomes`.
///
/// # Errors
/// The parameter has no numbers, or no run has a number by the figure's name.
pub fn series(outcomes: &[Outcome], figure: &str, against: &str) -> Result<Vec<Series>, Box<dyn Error>> {
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
            "--plot {figure}: no run has a number by that name; there are {}",
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
    let series = groups.into_iter().zip(labels).map(|((_, group), label)| {
        let mut points: Vec<_> = group.into_iter().filter_map(|(x, rows)| point(x, &rows, figure)).collect();
        points.sort_by(|one, other| one.x.total_cmp(&other.x));
        Series { label, points }
    });
    Ok(series.filter(|series| !series.points.is_empty()).collect())
}

/// What each of `groups` has that not all have.
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
        return Some(Point { x, mean: 100.0 * failed as f64 / rows.len() as f64, low, high });
    }
    let mean = mean(&numbers(rows, figure))?;
    let margin = mean.margin.unwrap_or(0.0);
    Some(Point { x, mean: mean.mean, low: mean.mean - margin, high: mean.mean + margin })
}

/// The plot as SVG, light or dark as the page is that shows it.
///
/// # Errors
/// There is nothing to plot, or it can't be drawn.
pub fn plot(series: &[Series], figure: &str, against: &str) -> Result<String, Box<dyn Error>> {
    let points = || series.iter().flat_map(|series| &series.points);
    let largest = |of: fn(&Point) -> f64| points().map(of).fold(f64::NEG_INFINITY, f64::max);
    let smallest = |of: fn(&Point) -> f64| points().map(of).fold(f64::INFINITY, f64::min);
    if points().next().is_none() {
        return Err("no run is done yet: there is nothing to plot".into());
    }
    let xs = around(smallest(|point| point.x), largest(|point| point.x));
    let ys = around(smallest(|point| point.low).min(0.0), largest(|point| point.high));
    // The legend stands above what is plotted.
    let has_legend = series.iter().any(|series| !series.label.is_empty());
    let legend = if has_legend { (0.06 * (1 + series.len()) as f64).min(0.7) } else { 0.0 };
    let ys = ys.start..ys.end + (ys.end - ys.start) * legend / (1.0 - legend);
    let font = ("sans-serif", 14);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (720, 420)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(16)
            .x_label_area_size(40)
            .y_label_area_size(64)
            .build_cartesian_2d(xs, ys)?;
        chart
            .configure_mesh()
            .x_desc(against)
            .y_desc(if figure == FAILED { "failed, of 100" } else { figure })
            .light_line_style(TRANSPARENT)
            .label_style(font)
            .axis_desc_style(font)
            .draw()?;
        for (Series { label, points }, colour) in series.iter().zip(COLOURS.iter().cycle()) {
            let means = points.iter().map(|point| (point.x, point.mean));
            let drawn = chart.draw_series(LineSeries::new(means, colour.stroke_width(2)).point_size(4))?;
            if !label.is_empty() {
                let legend = move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2));
                drawn.label(label).legend(legend);
            }
            let intervals = points.iter().map(|point| {
                PathElement::new([(point.x, point.low), (point.x, point.high)], colour.stroke_width(1))
            });
            chart.draw_series(intervals)?;
        }
        if has_legend {
            let mut labels = chart.configure_series_labels();
            labels.position(SeriesLabelPosition::UpperLeft).label_font(font).draw()?;
        }
        area.present()?;
    }
    for_any_page(svg)
}

/// From `least` to `most` and somewhat more.
fn around(least: f64, most: f64) -> std::ops::Range<f64> {
    let room = 0.05 * (most - least);
    let room = if room > 0.0 { room } else { 1.0 };
    least - room..most + room
}
