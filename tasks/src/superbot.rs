//! The one place that says what a SuperBot module is made of, but for its pins. Images, simulators and tests
//! read it; `board` says what is wired to which pin.
//!
//! The paper gives two ATmega128 at 16 MHz, six docks and I2C between the MCUs; the lab's simulator ReMod3D
//! gives the docks and joints of each half. Addresses, rates and serial ports are our assumption.
//!
//! To move a task to the other MCU, move its line in [`RESIDENCE`], and its start to the `main.rs` of that
//! MCU.

use crate::dock::{Dock, DockSet};
use crate::message::TaskCode;
use crate::motor::Axis;
use crate::motor::end_stops::EndStops;
use crate::motor::potentiometer::Potentiometer;
use crate::router::{Residence, Residents, TaskSet};
use crate::sensor::Scale;

/// The MCUs' clock, in Hz (paper, section 3).
pub const CLOCK_HZ: u32 = 16_000_000;

/// The kernel's ticks per second.
pub const TICK_HZ: u32 = 1_000;

/// The rate of a dock's serial link, in bit/s; 8 data bits, no parity, 1 stop bit. Off by 0.2 % at 16 MHz.
pub const BAUD: u32 = 38_400;

/// The clock of the I2C bus between the MCUs, in Hz. 400 kHz is the most that the ATmega128 can do.
pub const I2C_HZ: u32 = 400_000;

/// The rounds of measurement and the periods of the joints' control, per second.
pub const ROUND_HZ: u32 = 1_000;

/// The PWM frequency of the joint motors, in Hz: just above the audible range.
pub const PWM_HZ: u32 = 20_000;

/// What differs between the two halves of a module.
pub struct Half {
    /// The MCU's own address on the I2C bus, 7 bits.
    pub address: u8,
    /// The dock at USART0.
    pub usart0: Dock,
    /// The dock at USART1.
    pub usart1: Dock,
    /// The dock at the serial port in software, to which Timer3 belongs. It hears nothing while it sends.
    pub timer3: Dock,
    /// The joint of the other half that bends the module as the first one here does.
    pub opposite: Axis,
    /// Whether the battery and its charger are here.
    pub has_battery: bool,
    /// Whether the memory that keeps a record without power is here.
    pub has_memory: bool,
}

/// The half with the docks Front, Left and Right.
pub const MASTER: Half = Half {
    address: 0x10,
    usart0: Dock::Front,
    usart1: Dock::Left,
    timer3: Dock::Right,
    opposite: SLAVE_AXES[0],
    has_battery: false,
    has_memory: true,
};

/// The half with the docks Back, Up and Down.
pub const SLAVE: Half = Half {
    address: 0x11,
    usart0: Dock::Back,
    usart1: Dock::Up,
    timer3: Dock::Down,
    opposite: MASTER_AXES[0],
    has_battery: true,
    has_memory: false,
};

impl Half {
    /// The docks of this half by their place: 0 is the one at USART0, 1 at USART1, 2 at Timer3.
    pub const fn docks(&self) -> [Dock; 3] {
        [self.usart0, self.usart1, self.timer3]
    }
}

/// The joints that each MCU drives.
pub const MASTER_AXES: [Axis; 2] = [Axis::Front, Axis::Roll];
pub const SLAVE_AXES: [Axis; 1] = [Axis::Back];

/// The scale of the motors' currents: 1 V per A, 4.88 mA a count.
pub const MOTOR_CURRENT: Scale = Scale { zero: 0, slope: 312 };

/// The limit that the current of a joint's motor is kept below, in mA.
const MOTOR_CURRENT_LIMIT: i16 = 800;

/// The same as the converter reads it.
pub const JOINT_CURRENT_LIMIT: u16 = MOTOR_CURRENT.reading(MOTOR_CURRENT_LIMIT);

/// The joints' potentiometers have 300.8 degrees over the converter's range, and their middle at 0 degrees:
/// 47/16 of 0.1 degree a count.
pub const POTENTIOMETER: Potentiometer = Potentiometer::new(512, 47);

/// The joints in the halves turn 90 degrees to either side.
pub const JOINT: EndStops = EndStops::new(-900, 900);

/// The roll joint turns 135 degrees to either side.
pub const ROLL: EndStops = EndStops::new(-1350, 1350);

/// The current of a docking motor, in mA, above which it is
/// [strained](crate::docking::latch::DockingMotor::step).
pub const LATCH_CURRENT_LIMIT: i16 = 500;

/// Which MCU has which docks, and runs which of the tasks that can be addressed.
pub const RESIDENCE: Residence = Residence {
    master: Residents {
        docks: DockSet::of(&MASTER.docks()),
        tasks: TaskSet::of(&[
            TaskCode::AC_RECEIVE,
            TaskCode::HORMONE,
            TaskCode::joint(MASTER_AXES[0]),
            TaskCode::joint(MASTER_AXES[1]),
            TaskCode::dock(MASTER.usart0),
            TaskCode::dock(MASTER.usart1),
            TaskCode::dock(MASTER.timer3),
            TaskCode::POWER_BEYOND,
            TaskCode::ACCELEROMETER,
            TaskCode::MASTER_TEMPERATURE,
            TaskCode::MEMORY,
            TaskCode::MASTER_INSPECTOR,
        ]),
    },
    slave: Residents {
        docks: DockSet::of(&SLAVE.docks()),
        tasks: TaskSet::of(&[
            TaskCode::CONSOLE,
            TaskCode::joint(SLAVE_AXES[0]),
            TaskCode::dock(SLAVE.usart0),
            TaskCode::dock(SLAVE.usart1),
            TaskCode::dock(SLAVE.timer3),
            TaskCode::POWER,
            TaskCode::SLAVE_TEMPERATURE,
            TaskCode::SLAVE_INSPECTOR,
        ]),
    },
};
