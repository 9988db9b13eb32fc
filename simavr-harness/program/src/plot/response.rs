//! Plots the measured responses of a busy module, its control of the joints and its interrupts, beside their
//! computed bounds.

use std::error::Error;
use std::io::Read;
use std::path::Path;

use plotters::coord::ranged1d::{IntoSegmentedCoord, SegmentValue};
use plotters::prelude::*;
use simavr_harness::bench::module::busy::{self, Seen};
use simavr_harness::{CLOCK_HZ, Controller};
use stack_bound::vectors;

use crate::dark::for_any_page;
use crate::response::{Bounds, bounds};

const SEEN: RGBColor = RGBColor(9, 105, 218);
const BOUND: RGBColor = RGBColor(207, 34, 46);
const FONT: (&str, u32) = ("sans-serif", 14);

/// One response: the longest measured and the computed bound, in microseconds.
struct Row {
    what: String,
    seen: f64,
    bound: f64,
}

/// Measures the images in `directory`, and plots the results beside the bounds in `json`.
pub fn plot(directory: &Path, json: &mut impl Read) -> Result<String, Box<dyn Error>> {
    let bounds = bounds(json)?;
    let mut all = Vec::new();
    for seen in busy::measure(directory, busy::SECONDS)? {
        all.extend(rows(&bounds, &seen)?);
    }
    draw(&all)
}

/// The measured responses of an MCU with their bounds. A response without a bound is an error.
fn rows(bounds: &Bounds, seen: &Seen) -> Result<Vec<Row>, Box<dyn Error>> {
    let (name, mcu) = match seen.controller {
        Controller::Master => ("master", &bounds.master),
        Controller::Slave => ("slave", &bounds.slave),
    };
    let row = |what: String, seen: u64, bound: Option<u64>| {
        let bound = bound.ok_or_else(|| format!("{name}: there is no computed bound of {what}"))?;
        Ok(Row { what: format!("{name}: {what}"), seen: microseconds(seen), bound: microseconds(bound) })
    };
    let control = seen
        .control
        .iter()
        .map(|(load, longest)| row(format!("joints' control, {load}"), *longest, mcu.response("MOTORS")));
    let waits = seen.waited.iter().map(|(vector, longest)| {
        let interrupt = vectors::name(*vector).map_or_else(|| format!("vector {vector}"), str::to_owned);
        row(format!("{interrupt} waits"), *longest, mcu.latency(*vector))
    });
    control.chain(waits).collect()
}

fn microseconds(cycles: u64) -> f64 {
    cycles as f64 * 1e6 / f64::from(CLOCK_HZ)
}

/// Draws a row for each response, the first one on top, with a line from the measured value to the bound.
fn draw(all: &[Row]) -> Result<String, Box<dyn Error>> {
    let rows = all.len() as i32;
    let label = |row: i32| all.get((rows - 1 - row) as usize).map_or("", |row| &row.what).to_owned();
    let most = all.iter().map(|row| row.bound).fold(1.0, f64::max);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (820, 500)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(16)
            .x_label_area_size(44)
            .y_label_area_size(250)
            .build_cartesian_2d((10.0..1.3 * most).log_scale(), (0..rows - 1).into_segmented())?;
        let labels = |value: &SegmentValue<i32>| match value {
            SegmentValue::CenterOf(row) => label(*row),
            _ => String::new(),
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .y_labels(all.len() + 1)
            .y_label_formatter(&labels)
            .x_label_formatter(&|x| format!("{x:.0}"))
            .x_desc("microseconds: longest seen blue, computed bound red")
            .light_line_style(TRANSPARENT)
            .label_style(FONT)
            .axis_desc_style(FONT)
            .draw()?;
        for (place, row) in (0..rows).rev().zip(all) {
            let at = |x: f64| (x, SegmentValue::CenterOf(place));
            chart.draw_series([PathElement::new([at(row.seen), at(row.bound)], BLACK.mix(0.4))])?;
            for (x, colour) in [(row.seen, SEEN), (row.bound, BOUND)] {
                chart.draw_series([Circle::new(at(x), 5, colour.filled())])?;
            }
        }
        area.present()?;
    }
    for_any_page(svg)
}

#[cfg(test)]
mod tests {
    use super::*;
    use simavr_harness::bench::module::busy::Load;
    use std::collections::BTreeMap;

    #[test]
    fn each_response_has_a_dot_for_what_was_seen_and_one_for_its_bound() {
        let mcu = r#"{"loads":[],"tasks":[{"task":"MOTORS","response":1600}],
            "interrupts":[{"vector":9,"latency":800}]}"#;
        let json = format!(r#"{{"master":{mcu},"slave":{mcu}}}"#);
        let bounds = bounds(&mut json.as_bytes()).expect("bounds");
        let control = vec![(Load::Babble, 320)];
        let mut seen = Seen { controller: Controller::Slave, control, waited: BTreeMap::from([(9, 160)]) };
        let all = rows(&bounds, &seen).expect("both have a bound");
        assert_eq!(
            all.iter().map(|row| [row.seen, row.bound]).collect::<Vec<_>>(),
            [[20.0, 100.0], [10.0, 50.0]]
        );
        let svg = draw(&all).expect("a plot");
        assert_eq!(svg.matches("<circle").count(), 4);
        assert!(svg.contains("control, babble") && svg.contains("slave: TIMER2 COMP waits"));
        seen.waited.insert(15, 1);
        let error = rows(&bounds, &seen).err().expect("nobody has computed that").to_string();
        assert!(error.contains("TIMER0 COMP"), "{error}");
    }
}
