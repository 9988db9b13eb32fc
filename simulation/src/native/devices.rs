//! The devices of a module: those of its body. Without a world these are joints that are at once where they
//! are told to be, docks that do what they are asked for a while later, and the accelerometer alone of all
//! sensors.

use hormone::action::{Docking, Posture};
use tasks::devices::memory::{Memory, Record};
use tasks::docking::latch::End;
use tasks::message::{Letter, Message, TaskCode};
use tasks::request::Request;
use tasks::router::Mcu;
use tasks::sensor::Sensor;

use super::eeprom::Eeprom;
use super::embodied::Embodied;

#[derive(Default)]
pub struct Devices {
    /// Where the joints were told to be, in degrees, by their indices. They stay there through a reset.
    joints: [Option<i8>; 3],
    /// The requests to docks, and when they were made.
    pub dockings: Vec<(u64, Docking)>,
    memory: Memory,
    eeprom: Eeprom,
    /// In a world, the devices that take the place of these.
    pub embodied: Option<Box<Embodied>>,
}

impl Devices {
    /// Does what a message asks the devices of an MCU for. Returns the sensor that is to be read, and the
    /// task that asks for it, if there is no body to read it.
    pub fn serve(&mut self, now: u64, mcu: Mcu, message: Message) -> Option<(Sensor, TaskCode)> {
        if let Some(embodied) = &mut self.embodied {
            embodied.receive(mcu, &Letter::of(message));
            return None;
        }
        match Request::from_payload(message.payload())? {
            Request::Read(sensor) => return Some((sensor, message.from().task())),
            Request::Turn { axis, angle, .. } => {
                self.joints[usize::from(axis.index())] = Some((angle / 10) as i8);
            }
            Request::Approach(dock) => self.dockings.push((now, Docking::Approach(dock))),
            Request::Keep(record) => {
                self.memory.keep(record);
                while self.memory.step(&mut self.eeprom) {}
            }
            Request::Latch(dock, End::Released) => self.dockings.push((now, Docking::Release(dock))),
            _ => {}
        }
        None
    }

    /// The master's program starts over. Returns the kept record, if no body keeps it.
    pub fn recall(&mut self) -> Option<Record> {
        self.memory = Memory::new();
        self.memory.recall(&mut self.eeprom)
    }

    /// Where the joints are; `None` if they were told nothing yet.
    pub fn posture(&self) -> Option<Posture> {
        let [motor0, roll, motor2] = self.joints;
        let is_told = self.joints.iter().any(Option::is_some);
        is_told.then(|| Posture {
            motor0: motor0.unwrap_or(0),
            roll: roll.unwrap_or(0),
            motor2: motor2.unwrap_or(0),
        })
    }
}

/// What a sensor reads, in its unit; `None` for all but the accelerometer.
pub fn value(sensor: Sensor, acceleration: [f64; 3]) -> Option<i16> {
    let [x, y, z] = acceleration.map(|axis| (axis * 1000.0) as i16);
    match sensor {
        Sensor::AccelerationX => Some(x),
        Sensor::AccelerationY => Some(y),
        Sensor::AccelerationZ => Some(z),
        _ => None,
    }
}
