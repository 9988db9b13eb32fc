//! Draws curves over a common axis, as SVG.

use std::error::Error;
use std::ops::Range;

use plotters::prelude::*;

use super::dark::for_any_page;

/// The colours of curves, used in turn. A dark page replaces them.
pub const COLOURS: [RGBColor; 6] = [
    RGBColor(9, 105, 218),
    RGBColor(207, 34, 46),
    RGBColor(26, 127, 55),
    RGBColor(130, 80, 223),
    RGBColor(154, 103, 0),
    RGBColor(87, 96, 106),
];

pub const FONT: (&str, u32) = ("sans-serif", 14);

pub struct Chart<'a> {
    /// The labels of the axes.
    pub x: &'a str,
    pub y: &'a str,
    pub curves: &'a [Curve],
    /// Whether each point has a dot.
    pub has_dots: bool,
}

pub struct Curve {
    /// Its label in the legend. Without a label the curve is not in the legend.
    pub label: String,
    pub points: Vec<Point>,
}

/// A point, and the range of the values for which it stands.
pub struct Point {
    pub x: f64,
    pub y: f64,
    pub low: f64,
    pub high: f64,
}

impl Point {
    pub fn at(x: f64, y: f64) -> Self {
        Point { x, y, low: y, high: y }
    }
}

impl Chart<'_> {
    /// The chart, light or dark like the page that shows it.
    ///
    /// # Errors
    /// The chart has no points, or can't be drawn.
    pub fn svg(&self) -> Result<String, Box<dyn Error>> {
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
        if points().next().is_none() {
            return Err("there is nothing to plot".into());
        }
        let largest = |of: fn(&Point) -> f64| points().map(of).fold(f64::NEG_INFINITY, f64::max);
        let smallest = |of: fn(&Point) -> f64| points().map(of).fold(f64::INFINITY, f64::min);
        let xs = around(smallest(|point| point.x), largest(|point| point.x));
        let ys = around(smallest(|point| point.low).min(0.0), largest(|point| point.high));
        // The legend is above the curves.
        let labels = self.curves.iter().filter(|curve| !curve.label.is_empty()).count();
        let legend = if labels > 0 { (0.06 * (1 + labels) as f64).min(0.7) } else { 0.0 };
        let ys = ys.start..ys.end + (ys.end - ys.start) * legend / (1.0 - legend);
        // Along an axis without an end plotters looks for marks for ever.
        if [&xs, &ys].iter().any(|range| !(range.end - range.start).is_finite()) {
            return Err("the numbers are too large to plot".into());
        }
        let mut svg = String::new();
        self.draw(&mut svg, xs, ys, labels > 0)?;
        for_any_page(svg)
    }

    fn draw(
        &self,
        svg: &mut String,
        xs: Range<f64>,
        ys: Range<f64>,
        has_legend: bool,
    ) -> Result<(), Box<dyn Error>> {
        let area = SVGBackend::with_string(svg, (720, 420)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(16)
            .x_label_area_size(40)
            .y_label_area_size(80)
            .build_cartesian_2d(xs, ys)?;
        chart
            .configure_mesh()
            .x_desc(self.x)
            .y_desc(self.y)
            .light_line_style(TRANSPARENT)
            .label_style(FONT)
            .axis_desc_style(FONT)
            .draw()?;
        for (Curve { label, points }, colour) in self.curves.iter().zip(COLOURS.iter().cycle()) {
            let line = LineSeries::new(points.iter().map(|point| (point.x, point.y)), colour.stroke_width(2));
            let drawn = chart.draw_series(line.point_size(if self.has_dots { 4 } else { 0 }))?;
            if !label.is_empty() {
                let legend = move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2));
                drawn.label(label).legend(legend);
            }
            let spans = points.iter().filter(|point| point.low < point.high);
            chart.draw_series(spans.map(|point| {
                PathElement::new([(point.x, point.low), (point.x, point.high)], colour.stroke_width(1))
            }))?;
        }
        if has_legend {
            let mut labels = chart.configure_series_labels();
            labels.position(SeriesLabelPosition::UpperLeft).label_font(FONT).draw()?;
        }
        area.present()?;
        Ok(())
    }
}

/// The range from `least` to `most`, with some space at both ends.
fn around(least: f64, most: f64) -> Range<f64> {
    let room = 0.05 * (most - least);
    let room = if room > 0.0 { room } else { 1.0 };
    least - room..most + room
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_end_is_not_plotted() {
        for [low, high] in
            [[-1e308, 1e308], [1.0, 1.75e308], [f64::NEG_INFINITY, f64::INFINITY], [f64::NAN; 2]]
        {
            let points = vec![Point { x: 1.0, y: 1.0, low, high }];
            let curves = [Curve { label: "a".into(), points }];
            let error = Chart { x: "x", y: "y", curves: &curves, has_dots: true }.svg().unwrap_err();
            assert!(error.to_string().contains("too large"), "{low} to {high}: {error}");
        }
    }
}
