//! The battery and its charger.

use super::surroundings::Surroundings;
use crate::device::Quantity;
use crate::dock::Dock;
use crate::message::TaskCode;
use crate::power::allowance::Allowance;
use crate::power::battery::{Battery, SETTLES};
use crate::power::charger::{Charger, Look};
use crate::request::{Report, Request};
use crate::sensor::Sensor;

/// Looks after which the other MCU is told once more that all is allowed: 16 s.
const REMINDER: u8 = 64;

/// The supply of a module, looked at each quarter of a second.
pub struct Supply {
    battery: Battery,
    charger: Charger,
    /// The task that asked for the charger last.
    client: TaskCode,
    /// What was allowed at the last look or order; `None` before the first look after a reset.
    allowed: Option<Allowance>,
    /// Looks since the other MCU was told.
    silent: u8,
    /// The current that came in through docks of the other MCU, in mA, as far as it is known since the last
    /// look.
    beyond: u16,
}

impl Supply {
    /// A full battery, until it is seen.
    pub const fn new() -> Self {
        let (battery, charger) = (Battery::new(), Charger::new());
        Supply { battery, charger, client: TaskCode::HORMONE, allowed: None, silent: 0, beyond: 0 }
    }

    /// What may be switched on.
    pub fn allowance(&self) -> Allowance {
        Allowance { level: self.battery.level(), is_charging: self.charger.is_on() }
    }

    /// Starts the measurements that the next [`look`](Self::look) needs.
    pub fn prepare(&mut self, around: &mut impl Surroundings) {
        around.look(Quantity::Sensor(Sensor::BatteryVoltage));
        around.look(Quantity::Sensor(Sensor::BatteryTemperature));
        if self.charger.is_on() {
            self.measure_currents(around);
        }
    }

    /// Starts measurements of the currents of all docks. Those of the other MCU will be [heard](Self::hear).
    fn measure_currents<S: Surroundings>(&mut self, around: &mut S) {
        self.beyond = 0;
        for dock in Dock::ALL {
            let sensor = Sensor::DockCurrent(dock);
            if S::HALF.docks().contains(&dock) {
                around.look(Quantity::Sensor(sensor));
            } else {
                around.request(TaskCode::POWER, Request::Read(sensor));
            }
        }
    }

    /// Takes in what the other MCU has measured for the supply.
    pub fn hear(&mut self, report: Report) {
        if let Report::Value(Sensor::DockCurrent(_), outward) = report {
            self.beyond = self.beyond.saturating_add(inward(outward));
        }
    }

    /// Looks at the battery, and tells HORMONE and the other MCU what has changed, and of the charger the
    /// task that asked for it. Returns what may be switched on, if that has changed.
    pub fn look(&mut self, around: &mut impl Surroundings) -> Option<Allowance> {
        let voltage = around.seen(Quantity::Sensor(Sensor::BatteryVoltage))?.max(0) as u16;
        let temperature = around.seen(Quantity::Sensor(Sensor::BatteryTemperature))?;
        let current = self.incoming(around);
        let charger = self.charger.look(Look { voltage, temperature, current });
        let before = self.battery.level();
        // The very first look is believed at once: if this MCU alone was reset, the battery may be empty.
        for _ in 0..if self.allowed.is_none() { SETTLES } else { 1 } {
            self.battery.look(voltage);
        }
        let allowance = self.allowance();
        let is_news = self.allowed.replace(allowance) != Some(allowance);
        self.silent += 1;
        // Shed the load before reporting the level: a task that hears of the level may ask for what it no
        // longer allows. Repeat it, because the other MCU may have been reset, or had no room for it.
        if is_news || allowance != Allowance::ALL || self.silent == REMINDER {
            self.tell(allowance, around);
        }
        if let Some(state) = charger {
            around.set_charger(self.charger.is_on());
            around.report(TaskCode::POWER, self.client, Report::Charger(state));
        }
        let level = self.battery.level();
        if level != before {
            around.report(TaskCode::POWER, TaskCode::HORMONE, Report::Battery(level));
        }
        is_news.then_some(allowance)
    }

    /// Begins to charge, or stops that, and tells the other MCU.
    pub fn charge(&mut self, is_on: bool, client: TaskCode, around: &mut impl Surroundings) {
        self.client = client;
        if is_on {
            self.charger.start();
            self.measure_currents(around);
        } else {
            self.charger.stop();
        }
        around.set_charger(self.charger.is_on());
        let allowance = self.allowance();
        // If the next look ends or interrupts this, that is news. The first look has news in any case.
        self.allowed = self.allowed.map(|_| allowance);
        self.tell(allowance, around);
    }

    fn tell(&mut self, allowance: Allowance, around: &mut impl Surroundings) {
        self.silent = 0;
        around.request(TaskCode::POWER, Request::Allow(allowance));
    }

    /// The current that comes in through all docks, in mA.
    fn incoming<S: Surroundings>(&self, around: &mut S) -> u16 {
        S::HALF.docks().into_iter().fold(self.beyond, |incoming, dock| {
            let outward = around.seen(Quantity::Sensor(Sensor::DockCurrent(dock))).unwrap_or(0);
            incoming.saturating_add(inward(outward))
        })
    }
}

impl Default for Supply {
    fn default() -> Self {
        Self::new()
    }
}

/// The current into a dock, from the current out of it; 0 if none comes in.
fn inward(outward: i16) -> u16 {
    outward.min(0).unsigned_abs()
}
