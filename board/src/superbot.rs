//! The board description: the wiring of the two boards of a SuperBot module. What does not depend on pins,
//! such as docks, rates and where tasks reside, is in [`tasks::superbot`].
//!
//! The paper gives two ATmega128 at 16 MHz, six docks and I2C between the MCUs; the lab's simulator ReMod3D
//! gives the docks and joints of each half. No schematic is public, so the rest is our assumption: pins,
//! channels and timers. With the schematic at hand, these two files have to be changed, and what the
//! simulator has at the pins (board/README.md, "Wiring").
//!
//! The serial ports of the docks: USART0 at RXD0 = PE0 and TXD0 = PE1, USART1 at RXD1 = PD2 and TXD1 = PD3.
//! The UART in software receives at PE7, which is both ICP3 and INT7, and sends at PE5, which is both OC3C
//! and INT5. Idle is high, as with the USARTs.

use tasks::docking::latch::End;
use tasks::sensor::Scale;

use crate::gpio::{Pin, Port, PortA, PortB, PortC, PortD, PortG};
use crate::input::Input;
use crate::pwm::{Output, Timer1A, Timer1B, Timer1C};

pub use tasks::superbot::{
    BAUD, CLOCK_HZ, Half, I2C_HZ, JOINT, MASTER, MASTER_AXES, MOTOR_CURRENT, POTENTIOMETER, PWM_HZ, ROLL,
    ROUND_HZ, SLAVE, SLAVE_AXES, TICK_HZ,
};

// --- Joints -------------------------------------------------------------------------------------

/// The speed of the joint in this half, Motor0 on the master and Motor2 on the slave: OC1A = PB5.
pub type JointPwm = Output<Timer1A>;

/// The direction of the joint in this half; high turns towards positive angles.
pub type JointDirection = Pin<PortC, 0>;

/// The potentiometer on the shaft of the joint in this half, and its motor's current.
pub const JOINT_POTENTIOMETER: Input = Input::direct(0);
pub const JOINT_CURRENT: Input = Input::direct(1);

/// The speed of the roll joint between the halves, Motor1: OC1B = PB6. On the master only.
pub type RollPwm = Output<Timer1B>;

/// The direction of the roll joint, on the master only; high turns towards positive angles.
pub type RollDirection = Pin<PortC, 1>;

/// The potentiometer on the shaft of the roll joint, and its motor's current, on the master only.
pub const ROLL_POTENTIOMETER: Input = Input::direct(2);
pub const ROLL_CURRENT: Input = Input::direct(3);

/// A pin for an oscilloscope, PB4: high while the joints' control computes.
pub type ControlProbe = Pin<PortB, 4>;

// --- Docks --------------------------------------------------------------------------------------

/// The docking motors: for each dock a bridge with two pins, by place and end from PC2 to PC7.
pub type LatchPort = PortC;
pub const LATCHES: u8 = 0b1111_1100;

/// The pin that drives the latch at this place towards this end.
pub fn latch(place: u8, end: End) -> u8 {
    end_switch(place, end) << 2
}

/// The supply of all three bridges, OC1C = PB7, and its duty in percent.
pub type LatchPwm = Output<Timer1C>;
pub const LATCH_DUTY: u8 = 75;

/// The end switches of the latches, closed to ground, by place and end from PA0 to PA5.
pub type SwitchPort = PortA;
pub const END_SWITCHES: u8 = 0b0011_1111;

/// The pin of the switch at this end of the latch at this place.
pub fn end_switch(place: u8, end: End) -> u8 {
    let pair = if end == End::Latched { 0b10 } else { 0b01 };
    match place {
        0 => pair,
        1 => pair << 2,
        _ => pair << 4,
    }
}

/// The power switches of the docks, by place from PD4 to PD6; high is closed.
pub type PowerPort = PortD;
pub const POWER_SWITCHES: u8 = 0b0111_0000;

/// The pin of the power switch at this place.
pub fn power_switch(place: u8) -> u8 {
    match place {
        0 => 1 << 4,
        1 => 1 << 5,
        _ => 1 << 6,
    }
}

/// The current of the dock at this place: ADC4 to ADC6. At rest it reads the middle, since the current flows
/// both ways.
pub const fn dock_current(place: u8) -> Input {
    Input::direct(4 + place)
}

/// The reading of a dock's current at rest, and the difference from it at which the switch opens: 2.5 A.
pub const DOCK_CURRENT_AT_REST: u16 = DOCK_CURRENT.reading(0);
pub const DOCK_CURRENT_LIMIT: u16 = DOCK_CURRENT.reading(2_500) - DOCK_CURRENT_AT_REST;

/// The emitters of this half's docks, whose light their neighbours reflect, PB0; high is on.
pub type Emitters = Pin<PortB, 0>;

/// The charger, PD7, on the slave only; high is on.
pub type Charger = Pin<PortD, 7>;

// --- The multiplexer ----------------------------------------------------------------------------

/// How much of its own light the dock at this place sees reflected.
pub const fn proximity(place: u8) -> Input {
    Input::multiplexed(place)
}

/// The current of whichever docking motor runs.
pub const LATCH_CURRENT: Input = Input::multiplexed(3);

/// The temperature of this half's board.
pub const TEMPERATURE: Input = Input::multiplexed(4);

/// The battery's voltage and temperature; on the slave only.
pub const BATTERY_VOLTAGE: Input = Input::multiplexed(5);
pub const BATTERY_TEMPERATURE: Input = Input::multiplexed(6);

/// The axes of the accelerometer; on the master only.
pub const ACCELERATION: [Input; 3] = [Input::multiplexed(5), Input::multiplexed(6), Input::multiplexed(7)];

/// Makes the pins of the multiplexer's address outputs, PG0 to PG2.
pub fn start_multiplexer() {
    PortG::set_direction(0b111, true);
}

/// Addresses an input of the multiplexer, 0 to 7.
pub fn select(number: u8) {
    PortG::set_output(!number & 0b111, false);
    PortG::set_output(number & 0b111, true);
}

// --- What readings mean -------------------------------------------------------------------------

/// The scale of the joints' potentiometers.
pub const ANGLE: Scale = POTENTIOMETER.sensor();

/// The scale of proximity, in counts.
pub const PROXIMITY: Scale = Scale { zero: 0, slope: 64 };

/// 0.5 V per A about 2.5 V: 9.77 mA a count.
pub const DOCK_CURRENT: Scale = Scale { zero: 512, slope: 625 };

/// The input has half the voltage: 9.77 mV a count.
pub const VOLTAGE: Scale = Scale { zero: 0, slope: 625 };

/// 10 mV per degree Celsius, 0.5 V at 0: 0.49 degrees a count.
pub const CELSIUS: Scale = Scale { zero: 102, slope: 312 };

/// 0.8 V per g about 2.5 V: 6.1 thousandths a count.
pub const GRAVITY: Scale = Scale { zero: 512, slope: 391 };
