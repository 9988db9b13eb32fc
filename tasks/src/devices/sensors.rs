//! Sensors: each is measured when a behaviour asks, and the answer goes there.

use super::surroundings::Surroundings;
use crate::device::Quantity;
use crate::message::TaskCode;
use crate::request::Report;
use crate::sensor::Sensor;

/// Readings that may be under way at once.
const AT_ONCE: usize = 4;

/// A reading under way.
#[derive(Clone, Copy)]
struct Reading {
    sensor: Sensor,
    client: TaskCode,
}

/// The sensors of one MCU.
pub struct Sensors {
    under_way: [Option<Reading>; AT_ONCE],
}

impl Sensors {
    /// No reading is under way.
    pub const fn new() -> Self {
        Sensors { under_way: [None; AT_ONCE] }
    }

    /// Begins a reading for `client`. Refused if too many are under way.
    pub fn read(&mut self, sensor: Sensor, client: TaskCode, around: &mut impl Surroundings) {
        match self.under_way.iter_mut().find(|place| place.is_none()) {
            Some(place) => {
                *place = Some(Reading { sensor, client });
                around.look(Quantity::Sensor(sensor));
            }
            None => _ = around.report(sensor.task(), client, Report::Refused(sensor.task())),
        }
    }

    /// Answers the readings that have been measured. Returns whether any reading is still under way.
    pub fn step(&mut self, around: &mut impl Surroundings) -> bool {
        for place in &mut self.under_way {
            let Some(Reading { sensor, client }) = *place else { continue };
            if let Some(value) = around.seen(Quantity::Sensor(sensor)) {
                *place = None;
                around.report(sensor.task(), client, Report::Value(sensor, value));
            }
        }
        self.under_way.iter().any(Option::is_some)
    }
}

impl Default for Sensors {
    fn default() -> Self {
        Self::new()
    }
}
