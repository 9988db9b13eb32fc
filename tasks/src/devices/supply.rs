//! The battery and its charger.

use kernel::Task;

use super::desk::Desk;
use crate::device::{Peripherals, Quantity};
use crate::message::TaskCode;
use crate::power::battery::{Battery, Level};
use crate::power::charger::{Charger, Look};
use crate::request::{Report, Request};
use crate::sensor::Sensor;

/// The supply of a module, looked at each quarter of a second.
pub struct Supply {
    battery: Battery,
    charger: Charger,
}

impl Supply {
    /// A full battery, until it is seen.
    pub const fn new() -> Self {
        Supply { battery: Battery::new(), charger: Charger::new() }
    }

    /// Has the battery measured for the next [`look`](Self::look).
    pub fn prepare(&mut self, task: &mut Task, board: &mut impl Peripherals) {
        board.look(task, Quantity::Sensor(Sensor::BatteryVoltage));
        board.look(task, Quantity::Sensor(Sensor::BatteryTemperature));
    }

    /// Looks at the battery, and tells HORMONE and the other MCU what has changed. Returns the battery's level if it has.
    pub fn look(&mut self, task: &mut Task, desk: &mut Desk, board: &mut impl Peripherals) -> Option<Level> {
        let voltage = board.seen(task, Quantity::Sensor(Sensor::BatteryVoltage))?.max(0) as u16;
        let temperature = board.seen(task, Quantity::Sensor(Sensor::BatteryTemperature))?;
        let current = incoming(task, board);
        if let Some(state) = self.charger.look(Look { voltage, temperature, current }) {
            board.set_charger(self.charger.is_on());
            desk.report(task, TaskCode::POWER, TaskCode::HORMONE, Report::Charger(state));
        }
        let level = self.battery.look(voltage)?;
        // Shed first: whoever hears of the level may ask for what it no longer allows.
        desk.request(task, TaskCode::POWER, Request::Shed(level));
        desk.report(task, TaskCode::POWER, TaskCode::HORMONE, Report::Battery(level));
        Some(level)
    }

    /// Begins to charge, or stops that.
    pub fn charge(&mut self, board: &mut impl Peripherals, is_on: bool) {
        if is_on {
            self.charger.start();
        } else {
            self.charger.stop();
        }
        board.set_charger(self.charger.is_on());
    }
}

impl Default for Supply {
    fn default() -> Self {
        Self::new()
    }
}

/// What comes in through the docks of this MCU, in mA.
fn incoming<P: Peripherals>(task: &mut Task, board: &mut P) -> u16 {
    let mut incoming = 0_u16;
    for dock in P::docks() {
        let outward = board.seen(task, Quantity::Sensor(Sensor::DockCurrent(dock))).unwrap_or(0);
        incoming = incoming.saturating_add(outward.min(0).unsigned_abs());
    }
    incoming
}
