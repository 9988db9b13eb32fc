//! `./x response --svg`: plots the load of the CPUs in the worst case, by event.

use std::error::Error;
use std::io::Read;

use plotters::coord::ranged1d::{IntoSegmentedCoord, SegmentValue};
use plotters::prelude::*;
use serde::Deserialize;

use super::arguments::Response;
use super::dark::for_any_page;
use super::json::Destination;

const INTERRUPTS: RGBColor = RGBColor(9, 105, 218);
const TASKS: RGBColor = RGBColor(207, 34, 46);
const FONT: (&str, u32) = ("sans-serif", 14);

/// The output of `superbot-time-bound --json` for both images.
#[derive(Deserialize)]
pub struct Bounds {
    pub master: Mcu,
    pub slave: Mcu,
}

/// The part for one image.
#[derive(Deserialize)]
pub struct Mcu {
    loads: Vec<Load>,
    #[serde(default)]
    interrupts: Vec<Interrupt>,
    #[serde(default)]
    tasks: Vec<Task>,
}

#[derive(Deserialize)]
struct Interrupt {
    vector: u8,
    latency: Option<u64>,
}

#[derive(Deserialize)]
struct Task {
    task: String,
    response: Option<u64>,
}

impl Mcu {
    /// The bound of a task's response time, in cycles; `None` if there is no bound.
    pub fn response(&self, name: &str) -> Option<u64> {
        self.tasks.iter().find(|task| task.task == name)?.response
    }

    /// The bound of the time that the interrupt of a vector waits, in cycles; `None` if there is no bound.
    pub fn latency(&self, vector: u8) -> Option<u64> {
        self.interrupts.iter().find(|interrupt| interrupt.vector == vector)?.latency
    }
}

/// The load of one event: cycles of interrupts and of tasks, and percent of the CPU.
#[derive(Deserialize)]
struct Load {
    event: String,
    interrupts: u64,
    tasks: u64,
    percent: f64,
}

/// Plots the bounds from the standard input.
pub fn run(options: &Response) -> Result<(), Box<dyn Error>> {
    let destination = Destination::file(&options.svg, None, "--svg")?;
    destination.write_text(&plot(&bounds(&mut std::io::stdin())?)?)
}

/// Reads the bounds.
///
/// # Errors
/// The text can't be read, or has no bounds.
pub fn bounds(json: &mut impl Read) -> Result<Bounds, Box<dyn Error>> {
    let mut text = String::new();
    json.read_to_string(&mut text).map_err(|error| format!("can't read the bounds: {error}"))?;
    serde_json::from_str(&text)
        .map_err(|error| format!("the bounds are not the output of `./x response --json`: {error}").into())
}

/// Plots both MCUs side by side.
fn plot(bounds: &Bounds) -> Result<String, Box<dyn Error>> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (1100, 520)).into_drawing_area();
        area.fill(&WHITE)?;
        let (left, right) = area.split_horizontally(680);
        let most = |mcu: &Mcu| mcu.loads.iter().map(|load| load.percent).fold(0.0, f64::max);
        let most = 1.05 * most(&bounds.master).max(most(&bounds.slave));
        // Without a bar, or along an axis without an end, plotters panics or looks for marks for ever.
        if bounds.master.loads.is_empty() || bounds.slave.loads.is_empty() || !most.is_finite() {
            return Err(
                "the bounds have no loads that can be plotted: give the output of `./x response --json`"
                    .into(),
            );
        }
        draw(&left, "master", &bounds.master, most, 320)?;
        draw(&right, "slave", &bounds.slave, most, 60)?;
        area.present()?;
    }
    for_any_page(svg)
}

/// Draws a bar for each event, the first one on top: interrupts, followed by tasks. `label` is the width of
/// labels in pixels.
fn draw(
    area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
    name: &str,
    mcu: &Mcu,
    most: f64,
    label: u32,
) -> Result<(), Box<dyn Error>> {
    let rows = mcu.loads.len() as i32;
    let event = |row: i32| mcu.loads.get((rows - 1 - row) as usize).map_or("", |load| &load.event).to_owned();
    let mut chart = ChartBuilder::on(area)
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(label)
        .build_cartesian_2d(0.0..most, (0..rows - 1).into_segmented())?;
    let labels = |value: &SegmentValue<i32>| match value {
        SegmentValue::CenterOf(row) if label > 100 => event(*row),
        _ => String::new(),
    };
    chart
        .configure_mesh()
        .disable_y_mesh()
        .y_labels(mcu.loads.len() + 1)
        .y_label_formatter(&labels)
        .x_labels(5)
        .x_desc(format!("{name}: percent of the CPU; interrupts blue, tasks red"))
        .light_line_style(TRANSPARENT)
        .label_style(FONT)
        .axis_desc_style(FONT)
        .draw()?;
    for (row, load) in (0..rows).rev().zip(&mcu.loads) {
        let all = (load.interrupts as f64 + load.tasks as f64).max(1.0);
        let end = load.percent * load.interrupts as f64 / all;
        for (range, colour) in [(0.0..end, INTERRUPTS), (end..load.percent, TASKS)] {
            let corners =
                [(range.start, SegmentValue::Exact(row)), (range.end, SegmentValue::Exact(row + 1))];
            let mut bar = Rectangle::new(corners, colour.filled());
            bar.set_margin(3, 3, 0, 0);
            if range.start < range.end {
                chart.draw_series([bar])?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_has_a_bar_for_what_interrupts_take_of_each_event_and_one_for_tasks() {
        let load = |event: &str, interrupts, tasks| {
            format!(
                r#"{{"event":"{event}","every":9,"interrupts":{interrupts},"tasks":{tasks},"percent":20.0}}"#
            )
        };
        let mcu = format!(r#"{{"loads":[{},{}],"tasks":[]}}"#, load("a tick", 5, 0), load("a period", 5, 5));
        let json = format!(r#"{{"master":{mcu},"slave":{mcu}}}"#);
        let svg = plot(&serde_json::from_str(&json).expect("bounds")).expect("a plot");
        assert_eq!(svg.matches(r##"fill="#0969DA""##).count(), 2 * 2 + 1, "and one for dark pages");
        assert_eq!(svg.matches(r##"fill="#CF222E""##).count(), 2 + 1);
        assert!(svg.contains("a period") && svg.contains("prefers-color-scheme: dark"));
    }

    #[test]
    fn bounds_that_can_not_be_plotted_are_refused() {
        let mcu = |interrupts: u64, percent: f64| {
            let load =
                format!(r#"{{"event":"a tick","interrupts":{interrupts},"tasks":1,"percent":{percent:e}}}"#);
            format!(r#"{{"loads":[{load}]}}"#)
        };
        let plotted = |master: &str| {
            let json = format!(r#"{{"master":{master},"slave":{}}}"#, mcu(1, 20.0));
            plot(&serde_json::from_str(&json).expect("bounds"))
        };
        for master in [r#"{"loads":[]}"#, &mcu(1, 1.75e308)] {
            let error = plotted(master).expect_err(master);
            assert!(error.to_string().contains("no loads that can be plotted"), "{error}");
        }
        assert!(plotted(&mcu(u64::MAX, 20.0)).is_ok());
    }
}
