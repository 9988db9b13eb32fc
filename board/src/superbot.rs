//! The board description: what is wired to what on the two boards of a SuperBot module.
//!
//! The paper gives two ATmega128 at 16 MHz, six docks and I2C between the MCUs; the lab's simulator
//! ReMod3D gives the docks and joints of each half. No schematic is public, so the rest is our
//! assumption: pins, channels, timers, addresses and rates. Whoever has the schematic changes this file.

use tasks::dock::Dock;
use tasks::docking::latch::End;
use tasks::motor::Axis;
use tasks::motor::joint;
use tasks::motor::potentiometer::Potentiometer;
use tasks::residence::RESIDENCE;
use tasks::sensor::Scale;

use crate::adc::Input;
use crate::gpio::{Pin, Port, PortA, PortB, PortC, PortD, PortG};
use crate::pwm::{Output, Timer1A, Timer1B, Timer1C};

/// The MCU's clock, in Hz (paper, section 3).
pub const CLOCK_HZ: u32 = 16_000_000;

/// The kernel's ticks per second.
pub const TICK_HZ: u32 = 1_000;

/// The rate of a dock's serial link, in bit/s; 8 data bits, no parity, 1 stop bit. Off by 0.2 % at 16 MHz.
pub const BAUD: u32 = 38_400;

/// The clock of the I2C bus between the MCUs, in Hz. 400 kHz is the most that the ATmega128 can do.
pub const I2C_HZ: u32 = 400_000;

/// The rounds of measurement and the periods of the joints' control, per second.
pub const ROUND_HZ: u32 = 1_000;

/// The PWM frequency of the joint motors, in Hz: just above hearing.
pub const PWM_HZ: u32 = 20_000;

/// What differs between the two halves of a module.
pub struct Half {
    /// The MCU's own address on the I2C bus, 7 bits.
    pub address: u8,
    /// The dock at USART0 (RXD0 = PE0, TXD0 = PE1).
    pub usart0: Dock,
    /// The dock at USART1 (RXD1 = PD2, TXD1 = PD3).
    pub usart1: Dock,
    /// The dock at the serial port in software: received at PE7, which is both ICP3 and INT7, sent at PE5,
    /// which is both OC3C and INT5. Idle is high, as at the USARTs. Timer3 belongs to it.
    pub timer3: Dock,
}

/// The half with the docks Front, Left and Right.
pub const MASTER: Half = Half { address: 0x10, usart0: Dock::Front, usart1: Dock::Left, timer3: Dock::Right };

/// The half with the docks Back, Up and Down.
pub const SLAVE: Half = Half { address: 0x11, usart0: Dock::Back, usart1: Dock::Up, timer3: Dock::Down };

impl Half {
    /// The docks of this half by their place: 0 is the one at USART0, 1 at USART1, 2 at Timer3.
    pub const fn docks(&self) -> [Dock; 3] {
        [self.usart0, self.usart1, self.timer3]
    }
}

/// The joints that each MCU drives.
pub const MASTER_AXES: [Axis; 2] = [Axis::Front, Axis::Roll];
pub const SLAVE_AXES: [Axis; 1] = [Axis::Back];

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

/// A potentiometer of 300.8 degrees over the converter's range, in its middle at 0 degrees: 47/16 of 0.1
/// degree a count.
const POTENTIOMETER: Potentiometer = Potentiometer::new(512, 47);

/// What a motor's current is kept below, in mA.
const MOTOR_CURRENT_LIMIT: i16 = 800;

/// The joints in the halves turn 90 degrees to either side.
pub const JOINT: joint::Description = joint::Description {
    potentiometer: POTENTIOMETER,
    lowest: -900,
    highest: 900,
    current_limit: MOTOR_CURRENT.reading(MOTOR_CURRENT_LIMIT),
};

/// The roll joint turns 135 degrees to either side.
pub const ROLL: joint::Description = joint::Description { lowest: -1350, highest: 1350, ..JOINT };

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

/// The current of the dock at this place: ADC4 to ADC6. At rest it is in the middle, for it flows both ways.
pub const fn dock_current(place: u8) -> Input {
    Input::direct(4 + place)
}

/// What the current of a dock reads at rest, and by how much less than this it may differ: 2.5 A.
pub const DOCK_CURRENT_AT_REST: u16 = DOCK_CURRENT.reading(0);
pub const DOCK_CURRENT_LIMIT: u16 = DOCK_CURRENT.reading(2_500) - DOCK_CURRENT_AT_REST;

/// The light of this half's docks for their neighbours' reflections, PB0; high is on.
pub type Emitters = Pin<PortB, 0>;

/// The charger, PD7, on the slave only; high is on.
pub type Charger = Pin<PortD, 7>;

// --- The multiplexer ----------------------------------------------------------------------------

/// What the dock at this place has reflected.
pub const fn proximity(place: u8) -> Input {
    Input::multiplexed(place)
}

/// The current of whichever docking motor runs.
pub const LATCH_CURRENT: Input = Input::multiplexed(3);

/// What a docking motor's current is kept below, in mA.
pub const LATCH_CURRENT_LIMIT: i16 = 500;

/// The temperature of this half's board.
pub const TEMPERATURE: Input = Input::multiplexed(4);

/// Of the battery; on the slave only.
pub const BATTERY_VOLTAGE: Input = Input::multiplexed(5);
pub const BATTERY_TEMPERATURE: Input = Input::multiplexed(6);

/// Of the accelerometer; on the master only.
pub const ACCELERATION: [Input; 3] = [Input::multiplexed(5), Input::multiplexed(6), Input::multiplexed(7)];

/// Makes outputs of the multiplexer's address, PG0 to PG2.
pub fn start_multiplexer() {
    PortG::set_direction(0b111, true);
}

/// Addresses an input of the multiplexer, 0 to 7.
pub fn select(number: u8) {
    PortG::set_output(!number & 0b111, false);
    PortG::set_output(number & 0b111, true);
}

// --- What readings mean -------------------------------------------------------------------------

/// Of the potentiometers, as above: 0.294 degrees a count.
pub const ANGLE: Scale = Scale { zero: 512, slope: 47 * 64 / 16 };

/// Of proximity, in counts.
pub const PROXIMITY: Scale = Scale { zero: 0, slope: 64 };

/// 1 V per A: 4.88 mA a count.
pub const MOTOR_CURRENT: Scale = Scale { zero: 0, slope: 312 };

/// 0.5 V per A about 2.5 V: 9.77 mA a count.
pub const DOCK_CURRENT: Scale = Scale { zero: 512, slope: 625 };

/// A half of the voltage: 9.77 mV a count.
pub const VOLTAGE: Scale = Scale { zero: 0, slope: 625 };

/// 10 mV per degree Celsius, 0.5 V at 0: 0.49 degrees a count.
pub const CELSIUS: Scale = Scale { zero: 102, slope: 312 };

/// 0.8 V per g about 2.5 V: 6.1 thousandths a count.
pub const GRAVITY: Scale = Scale { zero: 512, slope: 391 };

// The docks that are wired to an MCU reside there.
const _: () = {
    let (master, slave) = (RESIDENCE.master.docks, RESIDENCE.slave.docks);
    assert!(
        master.contains(MASTER.usart0) && master.contains(MASTER.usart1) && master.contains(MASTER.timer3)
    );
    assert!(slave.contains(SLAVE.usart0) && slave.contains(SLAVE.usart1) && slave.contains(SLAVE.timer3));
};
