//! The nineteen sensors of a module (paper, section 3, which does not name them; `docs/decisions.md` tells
//! why these).
//!
//! A behaviour asks the task of the sensor's device, on whichever MCU that runs; the task has the converter
//! look and answers ([`request`](crate::request)).

use crate::dock::Dock;
use crate::message::TaskCode;
use crate::motor::Axis;

/// One sensor.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub enum Sensor {
    /// The angle of a joint, in 0.1 degree.
    Angle(Axis),
    /// The current of a joint's motor, in mA.
    MotorCurrent(Axis),
    /// The current out of a dock, in mA.
    DockCurrent(Dock),
    /// In mV.
    BatteryVoltage,
    /// In 0.1 degree Celsius.
    BatteryTemperature,
    /// Along the axes of the half with the Front dock, in thousandths of the acceleration of gravity: x to
    /// the Front, y to the Left, z up. At rest the axis that points up reads 1000.
    AccelerationX,
    AccelerationY,
    AccelerationZ,
    /// In 0.1 degree Celsius.
    MasterTemperature,
    SlaveTemperature,
}

impl Sensor {
    /// How many there are.
    pub const COUNT: u8 = 19;

    /// The sensor with this code; `None` above 18.
    pub fn from_code(code: u8) -> Option<Sensor> {
        match code {
            0..3 => Axis::from_index(code).map(Sensor::Angle),
            3..6 => Axis::from_index(code - 3).map(Sensor::MotorCurrent),
            6..12 => Dock::from_index(code - 6).map(Sensor::DockCurrent),
            12 => Some(Sensor::BatteryVoltage),
            13 => Some(Sensor::BatteryTemperature),
            14 => Some(Sensor::AccelerationX),
            15 => Some(Sensor::AccelerationY),
            16 => Some(Sensor::AccelerationZ),
            17 => Some(Sensor::MasterTemperature),
            18 => Some(Sensor::SlaveTemperature),
            _ => None,
        }
    }

    /// The sensor's code, 0 to 18.
    pub fn code(self) -> u8 {
        match self {
            Sensor::Angle(axis) => axis.index(),
            Sensor::MotorCurrent(axis) => 3 + axis.index(),
            Sensor::DockCurrent(dock) => 6 + dock.index(),
            Sensor::BatteryVoltage => 12,
            Sensor::BatteryTemperature => 13,
            Sensor::AccelerationX => 14,
            Sensor::AccelerationY => 15,
            Sensor::AccelerationZ => 16,
            Sensor::MasterTemperature => 17,
            Sensor::SlaveTemperature => 18,
        }
    }

    /// The task of the device that the sensor belongs to.
    pub fn task(self) -> TaskCode {
        match self {
            Sensor::Angle(axis) | Sensor::MotorCurrent(axis) => TaskCode::joint(axis),
            Sensor::DockCurrent(dock) => TaskCode::dock(dock),
            Sensor::BatteryVoltage | Sensor::BatteryTemperature => TaskCode::POWER,
            Sensor::AccelerationX | Sensor::AccelerationY | Sensor::AccelerationZ => TaskCode::ACCELEROMETER,
            Sensor::MasterTemperature => TaskCode::MASTER_TEMPERATURE,
            Sensor::SlaveTemperature => TaskCode::SLAVE_TEMPERATURE,
        }
    }
}

/// The scale of a sensor's readings: a straight line.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Scale {
    /// The reading at which the value is 0; it may lie outside of what the converter gives.
    pub zero: i16,
    /// The change of the value for each count, in 1/64 of its unit.
    pub slope: i16,
}

impl Scale {
    /// The value at this reading, in the sensor's unit.
    pub fn value(self, reading: u16) -> i16 {
        let value = ((i32::from(reading) - i32::from(self.zero)) * i32::from(self.slope)) >> 6;
        value.clamp(i16::MIN.into(), i16::MAX.into()) as i16
    }

    /// The least reading whose value is at least `value`, for limits that are compared with readings. For
    /// constants only: it divides.
    pub const fn reading(self, value: i16) -> u16 {
        assert!(self.slope > 0, "readings must rise with the value");
        let above = (value as i32 * 64 + self.slope as i32 - 1).div_euclid(self.slope as i32);
        let reading = self.zero as i32 + above;
        assert!(reading >= 0 && reading <= 1023, "the converter can't read this");
        reading as u16
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn there_are_nineteen_each_with_a_code_of_its_own() {
        let sensors: HashSet<_> = (0..Sensor::COUNT).map(|code| Sensor::from_code(code).unwrap()).collect();
        assert_eq!(sensors.len(), 19);
        for code in 0..=u8::MAX {
            let sensor = Sensor::from_code(code);
            assert_eq!(sensor.map(Sensor::code), (code < Sensor::COUNT).then_some(code));
            assert!(sensor.is_none_or(|sensor| !sensor.task().is_behaviour()));
        }
    }

    #[test]
    fn each_belongs_to_its_device() {
        let joints = Axis::ALL.map(TaskCode::joint);
        let docks = Dock::ALL.map(TaskCode::dock);
        let power = [TaskCode::POWER; 2];
        let accelerometer = [TaskCode::ACCELEROMETER; 3];
        let thermometers = [TaskCode::MASTER_TEMPERATURE, TaskCode::SLAVE_TEMPERATURE];
        let devices = [&joints[..], &joints, &docks, &power, &accelerometer, &thermometers].concat();
        let belongs = (0..Sensor::COUNT).map(|code| Sensor::from_code(code).unwrap().task());
        assert_eq!(belongs.collect::<std::vec::Vec<_>>(), devices);
    }

    #[test]
    fn a_limit_as_a_reading_is_the_first_that_reaches_it() {
        let scale = Scale { zero: 512, slope: 625 };
        for value in (-4_900..4_900).step_by(7) {
            let reading = scale.reading(value);
            assert!(scale.value(reading) >= value && scale.value(reading - 1) < value, "{value}");
        }
        assert_eq!(Scale { zero: -20_000, slope: 640 }.value(1023), i16::MAX);
    }
}
