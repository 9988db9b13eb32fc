//! The devices of one MCU of a module in a world: their state machines, as the MCU's tasks drive them, and
//! what is around these.

use tasks::device::Quantity;
use tasks::devices::memory::Cells;
use tasks::devices::surroundings::Surroundings;
use tasks::devices::{Devices, Mail};
use tasks::dock::{Dock, DockSet};
use tasks::docking::latch::{End, EndSwitches};
use tasks::message::{Address, Letter, Message, TaskCode};
use tasks::motor::joint::{Joint, Reading, State};
use tasks::motor::joints::{self, Awaited, Joints, Order, WATCH};
use tasks::motor::{Axis, FULL_DRIVE, Position, to_angle};
use tasks::request::Payload;
use tasks::sensor::Sensor;
use tasks::superbot::{Half as Description, JOINT, MASTER, ROLL, SLAVE};

use super::eeprom::Eeprom;
use crate::body::{Body, Drives};

/// The devices of the master, or of the slave.
pub struct Half<const N: usize, const IS_SLAVE: bool> {
    joints: Joints<N>,
    devices: Devices<N>,
    hands: Hands<N>,
    /// Milliseconds since its program runs.
    ticks: u16,
    /// When joints at rest are looked at.
    look_at: u16,
}

/// The devices that the state machines move.
struct Hands<const N: usize> {
    axes: [Axis; N],
    panels: [Panel; N],
    /// Where docking motors drive their latches, by docks, as [`Drives`] has it.
    latches: [i8; 6],
    closed: DockSet,
    is_charging: bool,
    emitters: bool,
    eeprom: Eeprom,
    /// The letters that they have sent.
    sent: Vec<Letter>,
}

/// A joint as others see it.
#[derive(Clone, Copy)]
struct Panel {
    order: Option<Order>,
    state: State,
    position: Option<Position>,
    /// The drive from the next millisecond on.
    drive: i16,
}

/// The surroundings of the state machines.
struct Around<'a, const N: usize, const IS_SLAVE: bool> {
    body: &'a mut Body,
    hands: &'a mut Hands<N>,
}

impl<const N: usize, const IS_SLAVE: bool> Half<N, IS_SLAVE> {
    /// Devices at power-up, which have kept nothing.
    pub fn new(axes: [Axis; N], body: &mut Body) -> Self {
        Self::keeping(Eeprom::default(), axes, body)
    }

    /// The MCU's program starts over.
    pub fn reset(&mut self, body: &mut Body) {
        let eeprom = std::mem::take(&mut self.hands.eeprom);
        *self = Self::keeping(eeprom, self.hands.axes, body);
    }

    /// Devices at the start of the MCU's program.
    fn keeping(eeprom: Eeprom, axes: [Axis; N], body: &mut Body) -> Self {
        let panel = Panel { order: None, state: State::Off, position: None, drive: 0 };
        let mut hands = Hands {
            axes,
            panels: [panel; N],
            latches: [0; 6],
            closed: DockSet::EMPTY,
            is_charging: false,
            emitters: false,
            eeprom,
            sent: Vec::new(),
        };
        let joint = |axis| Joint::new(if axis == Axis::Roll { ROLL } else { JOINT });
        let mut around = Around::<N, IS_SLAVE> { body, hands: &mut hands };
        let devices = Devices::new(axes, 0, &mut around);
        Half { joints: Joints::new(axes.map(joint)), devices, hands, ticks: 0, look_at: 0 }
    }

    /// Gives a message to the devices.
    pub fn receive(&mut self, body: &mut Body, letter: &Letter) {
        let mut around = Around::<N, IS_SLAVE> { body, hands: &mut self.hands };
        if let Some(mail) = Mail::of::<Around<N, IS_SLAVE>>(letter) {
            self.devices.receive(self.ticks, mail, &mut around);
            self.devices.poll(self.ticks, &mut around);
        }
    }

    /// A millisecond begins: adds to `drives` what motors and switches do in it. What is computed now takes
    /// effect in the next. Returns what the devices tell.
    pub fn step(&mut self, body: &mut Body, drives: &mut Drives) -> Vec<Letter> {
        self.ticks = self.ticks.wrapping_add(1);
        self.hands.add_to(drives);
        let mut around = Around::<N, IS_SLAVE> { body, hands: &mut self.hands };
        let is_ordered = around.hands.panels.iter().any(|panel| panel.order.is_some());
        let mut is_news = false;
        match self.joints.awaited() {
            Awaited::Order if !is_ordered => {}
            Awaited::OrderOrLook if !is_ordered && self.ticks != self.look_at => {}
            Awaited::Order | Awaited::OrderOrLook => {
                self.look_at = self.ticks.wrapping_add(WATCH);
                self.joints.order_or_look(is_ordered, &mut around);
            }
            Awaited::FirstPeriod => self.joints.first_period(&mut around),
            Awaited::Measurement => self.joints.measurement(&mut around),
            Awaited::Period => {
                self.look_at = self.ticks.wrapping_add(WATCH);
                is_news = self.joints.period(is_ordered, &mut around);
            }
        }
        let due = self.devices.next_due::<Around<N, IS_SLAVE>>(self.ticks);
        if is_news || due == Some(0) {
            self.devices.poll(self.ticks, &mut around);
        }
        std::mem::take(&mut self.hands.sent)
    }

    /// Whether it drives the latch of `dock`.
    pub fn drives_latch(&self, dock: Dock) -> bool {
        self.hands.latches[usize::from(dock.index())] != 0
    }

    /// The docks that send out light, to look for others.
    pub fn looking(&self) -> DockSet {
        if self.hands.emitters { DockSet::of(&description(IS_SLAVE).docks()) } else { DockSet::EMPTY }
    }
}

/// The description of a half.
const fn description(is_slave: bool) -> Description {
    if is_slave { SLAVE } else { MASTER }
}

impl<const N: usize> Hands<N> {
    fn add_to(&self, drives: &mut Drives) {
        for (axis, panel) in self.axes.iter().zip(&self.panels) {
            drives.duties[usize::from(axis.index())] = f64::from(panel.drive) / f64::from(FULL_DRIVE);
        }
        for (drive, latch) in drives.latches.iter_mut().zip(self.latches) {
            *drive += latch;
        }
        drives.closed = drives.closed.union(self.closed);
        drives.is_charging |= self.is_charging;
    }
}

impl<const N: usize, const IS_SLAVE: bool> joints::Surroundings for Around<'_, N, IS_SLAVE> {
    // The world measures the joints each millisecond, whether they are looked at or not.
    fn begin(&mut self) {}
    fn end(&mut self) {}
    fn look(&mut self) {}
    fn done(&mut self) {}

    fn reading(&mut self, joint: usize) -> Reading {
        self.body.reading(self.hands.axes[joint])
    }

    fn drive(&mut self, joint: usize, drive: i16) {
        self.hands.panels[joint].drive = drive;
    }

    fn take_order(&mut self, joint: usize) -> Option<Order> {
        self.hands.panels[joint].order.take()
    }

    fn show_position(&mut self, joint: usize, position: Option<Position>) {
        self.hands.panels[joint].position = position;
    }

    fn show_state(&mut self, joint: usize, state: State) {
        self.hands.panels[joint].state = state;
    }
}

impl<const N: usize, const IS_SLAVE: bool> Cells for Around<'_, N, IS_SLAVE> {
    fn is_ready(&mut self) -> bool {
        self.hands.eeprom.is_ready()
    }

    fn recall(&mut self, address: u16) -> u8 {
        self.hands.eeprom.recall(address)
    }

    fn store(&mut self, address: u16, byte: u8) {
        self.hands.eeprom.store(address, byte);
    }
}

impl<const N: usize, const IS_SLAVE: bool> Surroundings for Around<'_, N, IS_SLAVE> {
    const HALF: Description = description(IS_SLAVE);

    fn look(&mut self, _: Quantity) {}

    fn seen(&mut self, quantity: Quantity) -> Option<i16> {
        let body = &mut *self.body;
        let value = match quantity {
            Quantity::Proximity(dock) => f64::from(body.light_reading(dock)),
            Quantity::LatchCurrent => {
                Self::HALF.docks().into_iter().map(|dock| body.latch(dock).amperes()).sum::<f64>() * 1e3
            }
            Quantity::Sensor(sensor) => match sensor {
                Sensor::Angle(axis) => body.joint(axis).degrees() * 10.0,
                Sensor::MotorCurrent(axis) => body.joint(axis).amperes().abs() * 1e3,
                Sensor::DockCurrent(dock) if self.hands.closed.contains(dock) => {
                    body.dock_amperes[usize::from(dock.index())] * 1e3
                }
                Sensor::DockCurrent(_) => 0.0,
                Sensor::AccelerationX => body.acceleration[0] * 1e3,
                Sensor::AccelerationY => body.acceleration[1] * 1e3,
                Sensor::AccelerationZ => body.acceleration[2] * 1e3,
                Sensor::BatteryVoltage => body.battery.volts() * 1e3,
                Sensor::BatteryTemperature => body.battery.celsius * 10.0,
                Sensor::MasterTemperature => body.celsius[0] * 10.0,
                Sensor::SlaveTemperature => body.celsius[1] * 10.0,
            },
        };
        Some(value as i16)
    }

    fn end_switches(&mut self, dock: Dock) -> EndSwitches {
        self.body.end_switches(dock)
    }

    fn drive_latch(&mut self, dock: Dock, to: Option<End>) {
        self.hands.latches[usize::from(dock.index())] = match to {
            Some(End::Latched) => 1,
            Some(End::Released) => -1,
            None => 0,
        };
    }

    fn set_power(&mut self, dock: Dock, is_on: bool) {
        if is_on {
            self.hands.closed.insert(dock);
        } else {
            self.hands.closed.remove(dock);
        }
    }

    /// None: no current of a body is too much for its switch.
    fn take_tripped(&mut self) -> u8 {
        0
    }

    fn set_emitters(&mut self, is_on: bool) {
        self.hands.emitters = is_on;
    }

    fn set_charger(&mut self, is_on: bool) {
        self.hands.is_charging = is_on;
    }

    fn order(&mut self, joint: usize, order: Order) {
        let panel = &mut self.hands.panels[joint];
        (panel.order, panel.state) = (Some(order), order.state());
    }

    fn state(&mut self, joint: usize) -> Option<State> {
        Some(self.hands.panels[joint].state)
    }

    fn angle(&mut self, joint: usize) -> Option<i16> {
        self.hands.panels[joint].position.map(to_angle)
    }

    fn send(&mut self, from: TaskCode, to: TaskCode, payload: Payload) -> bool {
        let message = Message::new(Address::here(to), Address::here(from), &payload);
        self.hands.sent.extend(message.map(Letter::of));
        true
    }
}
