//! The board description: what is wired to what on the two boards of a SuperBot module.
//!
//! The paper gives two ATmega128 at 16 MHz, six docks and I2C between the MCUs; the lab's simulator
//! ReMod3D gives the docks and joints of each half. No schematic is public, so the rest is our
//! assumption: pins, channels, timers, addresses and rates. Whoever has the schematic changes this file.

use tasks::dock::{Dock, DockSet};
use tasks::message::TaskCode;
use tasks::router::{Residence, Residents, TaskSet};

use crate::adc::Channel;
use crate::gpio::{Pin, PortC};
use crate::pwm::{Output, Timer1A, Timer1B};

/// The MCU's clock, in Hz (paper, section 3).
pub const CLOCK_HZ: u32 = 16_000_000;

/// The kernel's ticks per second.
pub const TICK_HZ: u32 = 1_000;

/// The rate of a dock's serial link, in bit/s; 8 data bits, no parity, 1 stop bit. Off by 0.2 % at 16 MHz.
pub const BAUD: u32 = 38_400;

/// The clock of the I2C bus between the MCUs, in Hz. 400 kHz is the most that the ATmega128 can do.
pub const I2C_HZ: u32 = 400_000;

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

/// The speed of the joint in this half, Motor0 on the master and Motor2 on the slave: OC1A = PB5.
pub type JointPwm = Output<Timer1A>;

/// The direction of the joint in this half; high turns towards positive angles.
pub type JointDirection = Pin<PortC, 0>;

/// The potentiometer on the shaft of the joint in this half.
pub const JOINT_POTENTIOMETER: Channel = Channel::Adc0;

/// The speed of the roll joint between the halves, Motor1: OC1B = PB6. On the master only.
pub type RollPwm = Output<Timer1B>;

/// The direction of the roll joint, on the master only; high turns towards positive angles.
pub type RollDirection = Pin<PortC, 1>;

/// The potentiometer on the shaft of the roll joint, on the master only.
pub const ROLL_POTENTIOMETER: Channel = Channel::Adc1;

/// Which MCU has which docks, and runs which of the tasks that can be addressed.
pub const RESIDENCE: Residence = Residence {
    master: Residents {
        docks: DockSet::of(&[MASTER.usart0, MASTER.usart1, MASTER.timer3]),
        tasks: TaskSet::of(&[TaskCode::AC_RECEIVE, TaskCode::HORMONE]),
    },
    slave: Residents {
        docks: DockSet::of(&[SLAVE.usart0, SLAVE.usart1, SLAVE.timer3]),
        tasks: TaskSet::of(&[]),
    },
};
