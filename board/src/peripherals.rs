//! The devices at the docks, the battery's, the sensors' and the EEPROM, behind [`Peripherals`].

use core::marker::PhantomData;

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use kernel::Task;
use tasks::device;
use tasks::device::Quantity;
use tasks::dock::Dock;
use tasks::docking::latch::{End, EndSwitches};
use tasks::motor::Axis;
use tasks::sensor::{Scale, Sensor};

use crate::adc::Analog;
use crate::eeprom::Eeprom;
use crate::gpio::{Output, Port, PortB, PortD};
use crate::input::Input;
use crate::pwm::{self, Pwm, Timer1C};
use crate::superbot::{
    self, ACCELERATION, ANGLE, BATTERY_TEMPERATURE, BATTERY_VOLTAGE, CELSIUS, Charger, DOCK_CURRENT,
    Emitters, GRAVITY, Half, JOINT_CURRENT, JOINT_POTENTIOMETER, LATCH_CURRENT, LATCH_DUTY, LatchPort,
    LatchPwm, MASTER, MOTOR_CURRENT, PROXIMITY, PowerPort, ROLL_CURRENT, ROLL_POTENTIOMETER, SLAVE,
    SwitchPort, TEMPERATURE, VOLTAGE,
};

/// The docking motors' duty, of [`pwm::TOP`].
const DUTY: u16 = (pwm::TOP as u32 * LATCH_DUTY as u32 / 100) as u16;

/// One of the two halves of a module, named by its type.
pub trait Side {
    #[doc(hidden)]
    const HALF: Half;

    /// The input of a sensor that this half alone has, and the scale of its readings.
    #[doc(hidden)]
    fn sensor(sensor: Sensor) -> Option<(Input, Scale)>;
}

/// The half with the docks Front, Left and Right, the roll joint and the accelerometer.
pub enum MasterSide {}

/// The half with the docks Back, Up and Down, and the battery.
pub enum SlaveSide {}

impl Side for MasterSide {
    const HALF: Half = MASTER;

    fn sensor(sensor: Sensor) -> Option<(Input, Scale)> {
        let [x, y, z] = ACCELERATION;
        Some(match sensor {
            Sensor::Angle(Axis::Front) => (JOINT_POTENTIOMETER, ANGLE),
            Sensor::Angle(Axis::Roll) => (ROLL_POTENTIOMETER, ANGLE),
            Sensor::MotorCurrent(Axis::Front) => (JOINT_CURRENT, MOTOR_CURRENT),
            Sensor::MotorCurrent(Axis::Roll) => (ROLL_CURRENT, MOTOR_CURRENT),
            Sensor::AccelerationX => (x, GRAVITY),
            Sensor::AccelerationY => (y, GRAVITY),
            Sensor::AccelerationZ => (z, GRAVITY),
            Sensor::MasterTemperature => (TEMPERATURE, CELSIUS),
            _ => return None,
        })
    }
}

impl Side for SlaveSide {
    const HALF: Half = SLAVE;

    fn sensor(sensor: Sensor) -> Option<(Input, Scale)> {
        Some(match sensor {
            Sensor::Angle(Axis::Back) => (JOINT_POTENTIOMETER, ANGLE),
            Sensor::MotorCurrent(Axis::Back) => (JOINT_CURRENT, MOTOR_CURRENT),
            Sensor::BatteryVoltage => (BATTERY_VOLTAGE, VOLTAGE),
            Sensor::BatteryTemperature => (BATTERY_TEMPERATURE, CELSIUS),
            Sensor::SlaveTemperature => (TEMPERATURE, CELSIUS),
            _ => return None,
        })
    }
}

/// The latches of the docks of whichever half this is: both have their switches at the same pins.
pub struct Latches;

impl Latches {
    fn switches(place: u8) -> EndSwitches {
        // A switch that is pressed pulls its pin low.
        let pressed = !SwitchPort::input();
        let is_at = |end| pressed & superbot::end_switch(place, end) != 0;
        EndSwitches { is_released: is_at(End::Released), is_latched: is_at(End::Latched) }
    }

    /// Whether the docking motor at this place is on.
    fn is_driven(place: u8) -> bool {
        let both = superbot::latch(place, End::Released) | superbot::latch(place, End::Latched);
        LatchPort::output() & both != 0
    }
}

impl device::Latches for Latches {
    #[inline]
    fn is_open(dock: Dock) -> bool {
        let place = place(MASTER, dock).or(place(SLAVE, dock));
        place.is_some_and(|place| Self::switches(place).is_open(Self::is_driven(place)))
    }
}

/// The place of a dock in its half.
fn place(half: Half, dock: Dock) -> Option<u8> {
    let [first, second, third] = half.docks();
    match dock {
        _ if dock == first => Some(0),
        _ if dock == second => Some(1),
        _ if dock == third => Some(2),
        _ => None,
    }
}

/// The peripherals of the half `S`.
pub struct Peripherals<S> {
    analog: Analog,
    emitters: Output<PortB, 0>,
    charger: Output<PortD, 7>,
    eeprom: Eeprom,
    // Kept for its pin: the supply of the docking motors.
    _latch_supply: Pwm<Timer1C>,
    side: PhantomData<S>,
}

impl<S: Side> Peripherals<S> {
    /// The peripherals, all off.
    pub fn new(
        analog: Analog,
        supply: LatchPwm,
        emitters: Emitters,
        charger: Charger,
        eeprom: Eeprom,
    ) -> Self {
        SwitchPort::set_output(superbot::END_SWITCHES, true); // pull-ups
        LatchPort::set_direction(superbot::LATCHES, true);
        PowerPort::set_direction(superbot::POWER_SWITCHES, true);
        let mut supply = supply.start();
        let Ok(()) = supply.set_duty_cycle(DUTY);
        Peripherals {
            analog,
            emitters: emitters.into_output(),
            charger: charger.into_output(),
            eeprom,
            _latch_supply: supply,
            side: PhantomData,
        }
    }

    /// The place of a dock of this half.
    fn place(dock: Dock) -> Option<u8> {
        place(S::HALF, dock)
    }

    fn input(quantity: Quantity) -> Option<(Input, Scale)> {
        match quantity {
            Quantity::Sensor(Sensor::DockCurrent(dock)) => {
                Some((superbot::dock_current(Self::place(dock)?), DOCK_CURRENT))
            }
            Quantity::Sensor(sensor) => S::sensor(sensor),
            Quantity::Proximity(dock) => Some((superbot::proximity(Self::place(dock)?), PROXIMITY)),
            Quantity::LatchCurrent => Some((LATCH_CURRENT, MOTOR_CURRENT)),
        }
    }
}

impl<S: Side> device::Peripherals for Peripherals<S> {
    const HALF: Half = S::HALF;

    fn look(&mut self, task: &mut Task, quantity: Quantity) {
        if let Some((input, _)) = Self::input(quantity) {
            self.analog.look(task, input);
        }
    }

    fn seen(&mut self, task: &mut Task, quantity: Quantity) -> Option<i16> {
        let (input, scale) = Self::input(quantity)?;
        Some(scale.value(self.analog.seen(task, input)?))
    }

    fn end_switches(&mut self, dock: Dock) -> EndSwitches {
        let none = EndSwitches { is_released: false, is_latched: false };
        Self::place(dock).map_or(none, Latches::switches)
    }

    fn drive_latch(&mut self, dock: Dock, to: Option<End>) {
        let Some(place) = Self::place(dock) else { return };
        for end in [End::Released, End::Latched] {
            if to != Some(end) {
                LatchPort::set_output(superbot::latch(place, end), false);
            }
        }
        if let Some(end) = to {
            LatchPort::set_output(superbot::latch(place, end), true);
        }
    }

    fn set_power(&mut self, task: &mut Task, dock: Dock, is_on: bool) {
        if let Some(place) = Self::place(dock) {
            self.analog.watch(task, place, is_on);
            PowerPort::set_output(superbot::power_switch(place), is_on);
        }
    }

    fn take_tripped(&mut self, task: &mut Task) -> u8 {
        self.analog.take_tripped(task)
    }

    fn set_emitters(&mut self, is_on: bool) {
        let Ok(()) = if is_on { self.emitters.set_high() } else { self.emitters.set_low() };
    }

    fn set_charger(&mut self, is_on: bool) {
        let Ok(()) = if is_on { self.charger.set_high() } else { self.charger.set_low() };
    }

    fn is_memory_ready(&mut self, task: &mut Task) -> bool {
        self.eeprom.is_ready(task)
    }

    fn recall(&mut self, address: u16) -> u8 {
        self.eeprom.read(address)
    }

    fn store(&mut self, task: &mut Task, address: u16, byte: u8) {
        self.eeprom.write(task, address, byte);
    }
}
