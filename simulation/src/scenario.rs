//! A robot, and what happens to it.

use crate::change::Change;
use crate::images::OtherImages;
use crate::terrain::Terrain;
use crate::wiring::Wiring;

/// A robot at power-up, and what happens to it later.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    pub wiring: Wiring,
    /// `None` where nothing is said of it.
    pub terrain: Option<Terrain>,
    /// Of modules that are flashed with others than the rest.
    pub images: Vec<OtherImages>,
    /// In the order of time.
    pub timeline: Vec<Event>,
}

/// A change and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// In cycles since power-up.
    pub at: u64,
    pub change: Change,
}
