//! The table `[world]` of a robot file: what the robot moves on, and what it bears.
//!
//! Places are measured from the middle of module 0 at power-up: x ahead, y to the left.

use std::ops::RangeInclusive;

use serde::de::{Deserialize, Deserializer, Error};

use crate::fixed::Fixed;

/// What differs from level ground without anything on it. A field that is `None` is as the world assumes it.
#[derive(Clone, Debug, Default, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Terrain {
    /// The coefficient of friction between modules and all that they move on.
    #[serde(deserialize_with = "friction")]
    pub friction: Option<f64>,
    /// How steep it is: positive where it rises ahead.
    #[serde(deserialize_with = "slope")]
    pub slope_degrees: f64,
    /// The mass of each module.
    #[serde(deserialize_with = "module_mass")]
    pub module_kg: Option<f64>,
    pub steps: Option<Stair>,
    pub boxes: Vec<Block>,
    pub walls: Vec<Wall>,
    pub loads: Vec<Load>,
}

/// Steps that rise ahead, across the whole way.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stair {
    /// Where the first one begins.
    #[serde(deserialize_with = "place")]
    pub from_m: f64,
    #[serde(deserialize_with = "edge")]
    pub height_mm: f64,
    #[serde(deserialize_with = "edge")]
    pub length_mm: f64,
    #[serde(deserialize_with = "number")]
    pub number: usize,
}

/// A box that stands on the ground.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Its middle.
    #[serde(deserialize_with = "point")]
    pub at_m: [f64; 2],
    /// Its length, width and height.
    #[serde(deserialize_with = "edges")]
    pub size_mm: [f64; 3],
    /// How far it is turned to the left.
    #[serde(default, deserialize_with = "turn")]
    pub turned_degrees: f64,
}

/// A wall, 50 mm thick.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    #[serde(deserialize_with = "point")]
    pub from_m: [f64; 2],
    #[serde(deserialize_with = "point")]
    pub to_m: [f64; 2],
    #[serde(deserialize_with = "edge")]
    pub height_mm: f64,
}

/// The load that a module bears, spread evenly over it.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    pub module: usize,
    #[serde(deserialize_with = "load")]
    pub kg: f64,
}

fn within<'de, D: Deserializer<'de>>(
    deserializer: D,
    range: RangeInclusive<f64>,
    advice: &str,
) -> Result<f64, D::Error> {
    let value = f64::deserialize(deserializer)?;
    if range.contains(&value) { Ok(value) } else { Err(Error::custom(advice)) }
}

fn friction<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    within(deserializer, 0.0..=2.0, "give a coefficient of friction from 0 to 2").map(Some)
}

fn slope<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    within(deserializer, -45.0..=45.0, "give a slope from -45 to 45 degrees")
}

fn module_mass<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    within(deserializer, 0.1..=10.0, "give the mass of a module, from 0.1 to 10 kg").map(Some)
}

fn place<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    expect_place(f64::deserialize(deserializer)?)
}

fn point<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
    let Fixed([x, y]) = Fixed::deserialize(deserializer)?;
    Ok([expect_place(x)?, expect_place(y)?])
}

fn expect_place<E: Error>(metres: f64) -> Result<f64, E> {
    if metres.abs() <= 1000.0 { Ok(metres) } else { Err(E::custom("give a place from -1000 to 1000 m")) }
}

fn edge<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    expect_edge(f64::deserialize(deserializer)?)
}

fn edges<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 3], D::Error> {
    let Fixed([length, width, height]) = Fixed::deserialize(deserializer)?;
    Ok([expect_edge(length)?, expect_edge(width)?, expect_edge(height)?])
}

fn expect_edge<E: Error>(millimetres: f64) -> Result<f64, E> {
    if (1.0..=100_000.0).contains(&millimetres) {
        Ok(millimetres)
    } else {
        Err(E::custom("give an edge from 1 to 100000 mm"))
    }
}

fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    match usize::deserialize(deserializer)? {
        number @ 1..=1000 => Ok(number),
        _ => Err(Error::custom("give a number of steps from 1 to 1000")),
    }
}

fn turn<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    within(deserializer, -180.0..=180.0, "give a turn from -180 to 180 degrees")
}

fn load<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    within(deserializer, 0.0..=1000.0, "give a load from 0 to 1000 kg")
}
