//! A robot, and what happens to it.

use hormone::gait::GaitName;
use thiserror::Error;

use crate::change::Change;
use crate::hardware::CLOCK_HZ;
use crate::images::OtherImages;
use crate::terrain::Terrain;
use crate::wiring::{Wiring, WiringError};

/// A robot at power-up, and what happens to it later.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    pub wiring: Wiring,
    /// `None` if nothing is said of it.
    pub terrain: Option<Terrain>,
    /// The images of modules that are flashed with others than the rest.
    pub images: Vec<OtherImages>,
    /// In the order of time.
    pub timeline: Vec<Event>,
    /// All this as a robot file.
    pub file: String,
}

/// A change and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// In cycles since power-up.
    pub at: u64,
    pub change: Change,
}

impl Event {
    /// In seconds since power-up.
    pub fn seconds(&self) -> f64 {
        self.at as f64 / f64::from(CLOCK_HZ)
    }
}

/// An event that could not happen, and why.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("an event could not happen at {} s ({}): {why}", .event.seconds(), .event.change)]
pub struct Impossible {
    pub event: Event,
    pub why: WiringError,
}

/// What can happen to a robot, as far as that is known before it runs.
pub struct Forecast {
    wiring: Wiring,
    /// It was ordered to take another shape: whether a dock is free is not known from then on.
    docks_itself: bool,
}

impl Forecast {
    /// A robot at power-up.
    pub fn new(wiring: &Wiring) -> Self {
        Forecast { wiring: wiring.clone(), docks_itself: false }
    }

    /// Takes in the change that happens next.
    ///
    /// # Errors
    /// It can't happen, whatever the robot does by itself.
    pub fn take(&mut self, change: &Change) -> Result<(), WiringError> {
        match change.apply(&mut self.wiring) {
            Err(WiringError::DockInUse { .. } | WiringError::NotAttached { .. }) if self.docks_itself => {}
            taken => taken?,
        }
        let gait = change.orders().and_then(|(_, gait, _)| GaitName::from_byte(gait));
        self.docks_itself |= gait.is_some_and(|name| name.gait().once.is_some());
        Ok(())
    }
}
