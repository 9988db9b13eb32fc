//! `./x period`: the speed and range of a centipede by its Period, as a table and a plot.

use std::error::Error;
use std::fmt;

use hormone::gait::GaitName;
use hormone::hormone::Hormone;
use hormone::order::{Order, What};
use plotters::prelude::*;
use serde::Serialize;
use simavr_harness::{Images, Terrain};
use simulation::{Change, Face, MILLISECOND, Robot, Shape};
use tasks::dock::Dock;

use super::arguments::{Centipede, CoreName, Period};
use super::chart::{COLOURS, FONT};
use super::dark::for_any_page;
use super::images::load_images;
use super::json::{Destination, tell};
use super::output::say;
use super::terrain::on_terrain;

/// In ms.
const PERIODS: [u16; 7] = [500, 700, 1000, 1400, 2000, 2800, 4000];

/// The time at which the Period is ordered, in s.
const ORDERED: u64 = 1;

/// The time by which the legs have risen and walk by the Period, in s.
const RISEN: u64 = 4;

/// The results for a Period.
#[derive(Serialize)]
struct Row {
    period_ms: u16,
    /// The speed ahead.
    mm_per_second: f64,
    /// The mean current of the module that takes the most.
    amperes: f64,
    metres_per_charge: f64,
}

#[derive(Serialize)]
struct Table {
    modules: usize,
    seconds: u16,
    seed: u64,
    rows: Vec<Row>,
}

pub fn run(options: &Period) -> Result<(), Box<dyn Error>> {
    let destination = Destination::of(options.centipede.json.as_deref(), None)?;
    let svg = options.svg.as_deref();
    let svg = svg.map(|path| Destination::besides(destination.as_ref(), path, None, "--svg")).transpose()?;
    let images = load_images(&options.centipede.images, CoreName::Decoded)?;
    let mut rows = Vec::new();
    for period_ms in PERIODS {
        say(format_args!("superbot-sim: a Period of {period_ms} ms\n"));
        rows.push(row(options, &images, period_ms)?);
    }
    let plotted = svg.map(|svg| svg.write_text(&plot(&rows)?)).transpose();
    let Centipede { modules, seed, .. } = options.centipede;
    let table = Table { modules, seconds: options.seconds, seed, rows };
    // The figures are printed even if the plot can't be written.
    tell(destination, &table)?;
    plotted.map(|_| ())
}

fn row(options: &Period, images: &Images, period_ms: u16) -> Result<Row, Box<dyn Error>> {
    let wiring = Shape::Centipede.wiring(options.centipede.modules)?;
    let mut engine = on_terrain(&options.centipede, images, &wiring, &Terrain::default())?;
    engine.run_until(1000 * MILLISECOND * ORDERED);
    let period =
        hormone::period::Period::of_milliseconds(period_ms).ok_or("no such Period can be ordered")?;
    let order = Order { what: What::Walk(GaitName::Centipede as u8, period), serial: 1 };
    let payload = Hormone::Order(order).to_payload().as_slice().to_vec();
    let at = Face { module: 0, dock: Dock::Front };
    engine.robot_mut().change(&Change::Command { at, payload })?;
    let mut look = |seconds: u64| {
        engine.run_until(1000 * MILLISECOND * seconds);
        if let Some(trouble) = Robot::trouble(&engine) {
            return Err(format!("a Period of {period_ms} ms: {trouble}"));
        }
        let distance = Robot::motion(&engine).map_or(0.0, |motion| motion.distance);
        Ok((distance, engine.robot().charges_used().collect::<Vec<_>>()))
    };
    let [start, end] = [look(RISEN)?, look(options.seconds.into())?];
    let (distance, charge) = (end.0 - start.0, most_used(&start.1, &end.1));
    let seconds = (u64::from(options.seconds) - RISEN) as f64;
    Ok(Row {
        period_ms,
        mm_per_second: 1000.0 * distance / seconds,
        amperes: charge * plants::battery::CAPACITY / seconds,
        metres_per_charge: distance / charge,
    })
}

/// The charge that the module with the highest consumption took, from what each had taken at the start and at
/// the end.
fn most_used(start: &[f64], end: &[f64]) -> f64 {
    start.iter().zip(end).map(|(start, end)| end - start).fold(0.0, f64::max)
}

/// Plots speed and range over the Period, each with an axis of its own.
fn plot(rows: &[Row]) -> Result<String, Box<dyn Error>> {
    let mut svg = String::new();
    draw(rows, &mut svg)?;
    for_any_page(svg)
}

fn draw(rows: &[Row], svg: &mut String) -> Result<(), Box<dyn Error>> {
    let most = |of: fn(&Row) -> f64| 1.1 * rows.iter().map(of).fold(0.0, f64::max);
    let seconds = |row: &Row| f64::from(row.period_ms) / 1000.0;
    let [speed, reach, ..] = COLOURS;
    let area = SVGBackend::with_string(svg, (720, 420)).into_drawing_area();
    area.fill(&WHITE)?;
    let periods = 0.0..1.05 * rows.iter().map(seconds).fold(0.0, f64::max);
    let mut chart = ChartBuilder::on(&area)
        .margin(16)
        .x_label_area_size(40)
        .y_label_area_size(52)
        .right_y_label_area_size(52)
        .build_cartesian_2d(periods.clone(), 0.0..most(|row| row.mm_per_second))?
        .set_secondary_coord(periods, 0.0..most(|row| row.metres_per_charge));
    chart
        .configure_mesh()
        .x_desc("Period, s")
        .y_desc("speed, mm/s")
        .light_line_style(TRANSPARENT)
        .label_style(FONT)
        .axis_desc_style(FONT)
        .draw()?;
    chart
        .configure_secondary_axes()
        .y_desc("metres per charge")
        .label_style(FONT)
        .axis_desc_style(FONT)
        .draw()?;
    let points = |of: fn(&Row) -> f64| rows.iter().map(move |row| (seconds(row), of(row)));
    let speeds = points(|row| row.mm_per_second);
    let reaches = points(|row| row.metres_per_charge);
    chart
        .draw_series(LineSeries::new(speeds, speed.stroke_width(2)).point_size(4))?
        .label("speed")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], speed));
    chart
        .draw_secondary_series(LineSeries::new(reaches, reach.stroke_width(2)).point_size(4))?
        .label("metres per charge")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], reach));
    chart
        .configure_series_labels()
        .label_font(FONT)
        .position(SeriesLabelPosition::UpperRight)
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    Ok(())
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Table { modules, seconds, seed, .. } = self;
        writeln!(f, "centipede of {modules}, from {RISEN} to {seconds} s after power-up, seed {seed}\n")?;
        writeln!(f, "| Period | speed | current of the hungriest module | metres per charge |")?;
        writeln!(f, "|---|---|---|---|")?;
        for Row { period_ms, mm_per_second, amperes, metres_per_charge } in &self.rows {
            let seconds = f64::from(*period_ms) / 1000.0;
            writeln!(
                f,
                "| {seconds} s | {mm_per_second:.0} mm/s | {amperes:.2} A | {metres_per_charge:.0} m |"
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hungriest_module_need_not_be_the_one_that_has_taken_most_before() {
        assert_eq!(most_used(&[0.5, 0.0, 0.25], &[0.75, 0.5, 0.25]), 0.5);
    }

    #[test]
    fn a_plot_has_a_point_for_each_row_and_curve() {
        let row = |period_ms| Row { period_ms, mm_per_second: 100.0, amperes: 0.3, metres_per_charge: 200.0 };
        let svg = plot(&[row(500), row(1000), row(2000)]).unwrap();
        assert_eq!(svg.matches("<circle").count(), 6);
        assert!(svg.contains("prefers-color-scheme: dark"));
        assert!(svg.contains("Period, s") && svg.contains("metres per charge"));
    }
}
