//! Intervals of 95 % confidence, from samples.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The normal distribution's quantile at 0.975.
const Z: f64 = 1.959_963_984_540_054;

/// A mean, with its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The number of values.
    pub number: usize,
    pub mean: f64,
    /// Half the width of the interval; `None` for a single value.
    pub margin: Option<f64>,
}

/// The mean of `values` with the t-interval; `None` without values.
pub fn mean(values: &[f64]) -> Option<Mean> {
    let number = values.len();
    if number == 0 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / number as f64;
    let freedom = (number - 1) as f64;
    let margin = StudentsT::new(0.0, 1.0, freedom).ok().map(|distribution| {
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        distribution.inverse_cdf(0.975) * (squares / freedom / number as f64).sqrt()
    });
    Some(Mean { number, mean, margin })
}

/// The Wilson interval for the probability of an event that occurred in `some` of `all` cases; from 0 to 1
/// without any case.
pub fn wilson(some: usize, all: usize) -> [f64; 2] {
    if all == 0 {
        return [0.0, 1.0];
    }
    let (number, part) = (all as f64, some as f64 / all as f64);
    let scale = 1.0 + Z * Z / number;
    let centre = (part + Z * Z / (2.0 * number)) / scale;
    let margin = Z / scale * (part * (1.0 - part) / number + Z * Z / (4.0 * number * number)).sqrt();
    // At the ends, centre and margin would give 0 and 1 except for rounding.
    let low = if some == 0 { 0.0 } else { centre - margin };
    let high = if some == all { 1.0 } else { centre + margin };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(value: f64, expected: f64) {
        assert!((value - expected).abs() < 5e-5, "{value} is not {expected}");
    }

    /// Newcombe, Statistics in Medicine 17 (1998), Table I, method 3; at the ends z²/(n + z²).
    #[test]
    fn wilsons_interval_is_that_of_the_books() {
        for (some, all, [low, high]) in [
            (0, 40, [0.0, 0.0876]),
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
            (29, 29, [0.8830, 1.0]),
        ] {
            let [is_low, is_high] = wilson(some, all);
            assert_near(is_low, low);
            assert_near(is_high, high);
        }
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
    }

    /// Student's table: 12.7062 for one degree of freedom, 2.7764 for four.
    #[test]
    fn the_mean_has_students_interval() {
        let two = mean(&[1.0, 3.0]).unwrap();
        assert_near(two.mean, 2.0);
        assert_near(two.margin.unwrap(), 12.7062);
        let five = mean(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert_near(five.margin.unwrap(), 2.776_45 * (2.5_f64 / 5.0).sqrt());
        assert_eq!(mean(&[7.0; 3]).unwrap().margin, Some(0.0));
        assert_eq!(mean(&[7.0]), Some(Mean { number: 1, mean: 7.0, margin: None }));
        assert_eq!(mean(&[]), None);
    }
}
