//! Plots a step of a module's joints over time.

use std::error::Error;
use std::ops::Range;
use std::path::Path;

use simavr_harness::bench::module::{Sample, step_response};
use tasks::motor::Axis;

use crate::chart::{Chart, Curve, Point};

/// The time that is shown, in ms since power-up: the joints rest before and after it.
const SHOWN: Range<f64> = 400.0..1400.0;

pub fn plot(images: &Path) -> Result<String, Box<dyn Error>> {
    let samples = step_response(images)?;
    let curves: Vec<Curve> = Axis::ALL.into_iter().map(|axis| curve(&samples, axis)).collect();
    Chart { x: "since power-up, ms", y: "angle, degrees", curves: &curves, has_dots: false }.svg()
}

fn curve(samples: &[Sample], axis: Axis) -> Curve {
    let shown = samples.iter().filter(|sample| SHOWN.contains(&sample.ms));
    let points = shown.map(|sample| Point::at(sample.ms, sample.degrees[usize::from(axis.index())]));
    Curve { label: format!("joint {axis:?}"), points: points.collect() }
}
