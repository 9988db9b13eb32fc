//! Plots tasks against one loop: the longest times, case by case.

use std::error::Error;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;
use simavr_harness::bench::concurrency::{Case, Concurrency, Row, Style};

use super::super::chart::{COLOURS, FONT};
use super::super::dark::for_any_page;
use super::names::{name, title};

const TASKS: RGBColor = COLOURS[0];
const LOOP: RGBColor = COLOURS[1];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A panel for one of the longest times.
struct Panel {
    caption: &'static str,
    /// The time in us; `None` if the case does not have it.
    of: fn(&Row) -> Option<f64>,
    /// The limit that it must not exceed, in ms.
    limit: Option<f64>,
}

/// The range of all panels, in ms.
const RANGE: Range<f64> = 0.1..300.0;

/// `longest`, unless there were resets. They leave some edges or hormones without an answer, whose time is
/// not in `longest`.
fn answered(row: &Row, longest: Option<f64>) -> Option<f64> {
    longest.filter(|_| row.resets == 0)
}

/// The figures as SVG, light or dark like the page that shows it.
pub fn plot(figures: &Concurrency) -> Result<String, Box<dyn Error>> {
    let panels = [
        Panel {
            caption: "joints' control done, ms",
            of: |row| Some(row.control_done_us_max),
            limit: Some(1.0),
        },
        Panel { caption: "edge answered, ms", of: |row| answered(row, row.reaction_us_max), limit: None },
        Panel { caption: "hop, ms", of: |row| answered(row, row.hop_us_max), limit: None },
    ];
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (980, 330)).into_drawing_area();
        area.fill(&WHITE)?;
        let (labels, charts) = area.split_horizontally(170);
        let charts = charts.split_evenly((1, panels.len()));
        label(&labels)?;
        for (chart, panel) in charts.iter().zip(&panels) {
            draw(chart, panel, figures)?;
        }
        area.present()?;
    }
    for_any_page(svg)
}

/// The pixels of a panel above and below the plotted area.
const ABOVE: i32 = 40;
const BELOW: i32 = 50;

/// The height of a case in an area.
fn height(case: usize, area: &Area) -> i32 {
    let (_, height) = area.dim_in_pixel();
    ABOVE + (2 * case as i32 + 1) * (height as i32 - ABOVE - BELOW) / (2 * Case::ALL.len() as i32)
}

/// Draws the names of the cases and of the colours.
fn label(area: &Area) -> Result<(), Box<dyn Error>> {
    for (number, case) in Case::ALL.into_iter().enumerate() {
        area.draw(&Text::new(title(case), (12, height(number, area) - 7), FONT))?;
    }
    for (style, x) in [(Style::Tasks, 12), (Style::Loop, 90)] {
        area.draw(&Circle::new((x + 5, 20), 5, colour(style).filled()))?;
        area.draw(&Text::new(name(style), (x + 16, 13), FONT))?;
    }
    Ok(())
}

fn colour(style: Style) -> RGBColor {
    match style {
        Style::Tasks => TASKS,
        Style::Loop => LOOP,
    }
}

fn draw(area: &Area, panel: &Panel, figures: &Concurrency) -> Result<(), Box<dyn Error>> {
    let cases = 0.0..Case::ALL.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .margin_left(14)
        .margin_right(22)
        .margin_top(ABOVE)
        .x_label_area_size(BELOW)
        .build_cartesian_2d(RANGE.log_scale(), cases.clone())?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .y_labels(0)
        .x_labels(4)
        .x_label_formatter(&|value| value.to_string())
        .x_desc(panel.caption)
        .light_line_style(TRANSPARENT)
        .label_style(FONT)
        .axis_desc_style(FONT)
        .draw()?;
    if let Some(limit) = panel.limit {
        chart.draw_series([PathElement::new([(limit, cases.start), (limit, cases.end)], BLACK)])?;
    }
    let points = figures.cases.iter().filter_map(|row| {
        let number = Case::ALL.iter().position(|case| *case == row.case)?;
        let beside = if row.style == Style::Tasks { 0.12 } else { -0.12 };
        let y = cases.end - 0.5 - number as f64 + beside;
        Some(Circle::new(((panel.of)(row)? / 1000.0, y), 5, colour(row.style).filled()))
    });
    chart.draw_series(points)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use simavr_harness::bench::concurrency::Periodic;

    fn row(style: Style, resets: u64) -> Row {
        let period = Periodic { periods: 100, missed: 0, late_ms_max: 0.5 };
        Row {
            case: Case::Hangs,
            style,
            control_missed: 0,
            control_periods: 1_000,
            control_given_up: false,
            control_jitter_us: None,
            control_done_us_max: 200.0,
            joint_strays_deg_max: 1.0,
            bytes_lost: None,
            frames_repeated: 0,
            hormones_lost: Some(0),
            hop_us_mean: Some(3_000.0),
            hop_us_max: Some(4_000.0),
            reaction_us_mean: Some(50.0),
            reaction_us_max: Some(400.0),
            edges_unanswered: 0,
            seven: period,
            eleven: period,
            cpu_percent: 25.0,
            resets,
        }
    }

    #[test]
    fn a_plot_has_a_point_for_each_row_and_panel_but_for_what_resets_left_unanswered() {
        let cases = vec![row(Style::Tasks, 0), row(Style::Loop, 3)];
        let svg = plot(&Concurrency { seconds: 1, styles: Vec::new(), cases }).unwrap();
        let legend = Style::ALL.len();
        assert_eq!(svg.matches("<circle").count(), legend + 3 + 1);
        assert!(svg.contains("prefers-color-scheme: dark") && svg.contains("hop, ms"));
        for colour in ["#0969DA", "#CF222E", "#FFFFFF", "#000000"] {
            assert!(
                svg.matches(&format!("\"{colour}\"")).count() > 1,
                "no {colour}, which a dark page replaces"
            );
        }
    }
}
