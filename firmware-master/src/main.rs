//! The master MCU of a module: the docks Front, Left and Right, two joints, the accelerometer, its side of
//! the bridge, and the behaviours.
//!
//! This file is only wiring: the device that each task drives, and the stack that it runs on. Priorities fall
//! from tasks that a wire waits for to those that only the robot waits for (paper, section 6).

#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use board::delay;
use board::joints::Joints;
use board::peripherals::{Latches, MasterSide, Peripherals};
use board::reset::ResetCause;
use board::superbot::{JOINT, MASTER, MASTER_AXES, ROLL, SLAVE};
use console::inspector::{self, Counts, Inspected};
use hormone::behaviours::AdaptiveCommunication;
use hormone::gait::GaitName;
use hormone::status::Status;
use hormone::task::{Shared, ac_receive, ac_send, hormone as rules};
use kernel::{Boot, Context, MaskedCell, Mutex, Priority, Semaphore, Stack, Task, TaskHandle, Ticks};
use tasks::api::Api;
use tasks::bridge::task::{self as bridge, Bridge};
use tasks::devices::task::{self as devices, Desk};
use tasks::duty::Duty;
use tasks::link::port::Port;
use tasks::link::receive::{self, Incoming};
use tasks::link::send;
use tasks::mailbox::Mailbox;
use tasks::message::TaskCode;
use tasks::motor::joint::Joint;
use tasks::motor::joints;
use tasks::motor::task::{self as motor, Motors};
use tasks::post_office::PostOffice;
use tasks::router::{Mcu, Router};
use tasks::superbot::RESIDENCE;

#[cfg(feature = "trial")]
mod trial;

#[cfg(not(feature = "trial"))]
board::interrupts!(Interrupts: Tick, Usart0, Usart1, SoftUart, Twi, Adc);
#[cfg(feature = "trial")]
board::interrupts!(Interrupts: Tick, Usart0, Usart1, SoftUart, Twi, Adc, External);

// The simulator and debuggers find these by name; each begins with its counts.
#[unsafe(no_mangle)]
static LINK_USART0: Port = Port::new(MASTER.usart0);
#[unsafe(no_mangle)]
static LINK_USART1: Port = Port::new(MASTER.usart1);
#[unsafe(no_mangle)]
static LINK_SOFT_UART: Port = Port::new(MASTER.timer3);
#[unsafe(no_mangle)]
static BRIDGE: Bridge = Bridge::new();
#[unsafe(no_mangle)]
static MOTORS: Motors<2> = Motors::new();
#[unsafe(no_mangle)]
static DESK: Desk<2> = Desk::new(&MOTORS, &OFFICE);
#[unsafe(no_mangle)]
static MODULE_STATUS: Mutex<Status> = Mutex::new(Priority::P6, Status::POWER_UP);

/// Posted when a dock has received something.
static RECEIVED: Semaphore = Semaphore::new(0);
/// Why the MCU started, for debuggers.
#[unsafe(no_mangle)]
static RESET_CAUSE: MaskedCell<ResetCause> = MaskedCell::new(ResetCause::NONE);

static DEVICES: Mailbox = Mailbox::new(6);
static DEVICES_DUTY: Duty = Duty::new();
/// How late the devices' task may be before the watchdog is no longer fed, in ticks of 1 ms.
const LATE: Ticks = 2 * devices::ALIVE;
static ADAPTIVE_COMMUNICATION: Shared = Shared::new(Priority::P4, AdaptiveCommunication::new(0));
static AC_RECEIVE: Mailbox = Mailbox::new(6);
static AC_SEND: Mailbox = Mailbox::new(0);
static HORMONE: Mailbox = Mailbox::new(8);
static INSPECTOR: Mailbox = Mailbox::new(1);

static OFFICE: PostOffice = PostOffice {
    router: Router::new(Mcu::Master, RESIDENCE),
    tasks: &[
        (TaskCode::AC_RECEIVE, &AC_RECEIVE),
        (TaskCode::HORMONE, &HORMONE),
        (TaskCode::MASTER_INSPECTOR, &INSPECTOR),
    ],
    devices: &DEVICES,
    links: &[
        (MASTER.usart0, LINK_USART0.mailbox()),
        (MASTER.usart1, LINK_USART1.mailbox()),
        (MASTER.timer3, LINK_SOFT_UART.mailbox()),
    ],
    bridge: BRIDGE.mailbox(),
};

/// The stacks, in bytes. `./x stacks` tells how much each needs, and `./x build` fails when one has less.
mod stack {
    use super::Stack;

    pub static RECEIVE: Stack<282> = Stack::new();
    pub static SEND_USART0: Stack<208> = Stack::new();
    pub static SEND_USART1: Stack<208> = Stack::new();
    pub static SEND_SOFT_UART: Stack<208> = Stack::new();
    pub static MOTORS: Stack<199> = Stack::new();
    pub static DEVICES: Stack<286> = Stack::new();
    pub static BRIDGE: Stack<159> = Stack::new();
    pub static AC_RECEIVE: Stack<132> = Stack::new();
    pub static AC_SEND: Stack<114> = Stack::new();
    pub static HORMONE: Stack<394> = Stack::new();
    pub static INSPECTOR: Stack<80> = Stack::new();
}

/// All tasks, for the inspector: in the order in which the console names them.
static TASKS: [TaskHandle; 11] = [
    stack::MOTORS.task(),
    stack::RECEIVE.task(),
    stack::BRIDGE.task(),
    stack::SEND_USART0.task(),
    stack::SEND_USART1.task(),
    stack::SEND_SOFT_UART.task(),
    stack::DEVICES.task(),
    stack::AC_RECEIVE.task(),
    stack::AC_SEND.task(),
    stack::HORMONE.task(),
    stack::INSPECTOR.task(),
];

/// All counts, for the inspector.
static COUNTS: Counts = inspector::counts(
    [&LINK_USART0, &LINK_USART1, &LINK_SOFT_UART],
    BRIDGE.counts(),
    MOTORS.counts(),
    DESK.counts(),
);

kernel::main!(|boot| {
    if start(boot).is_none() {
        board::debug::halt();
    }
});

/// Starts every task. `None` if one of them can't be started.
fn start(boot: &mut Boot) -> Option<()> {
    let board = Board::take(boot)?;
    let [seed0, seed1, seed2] = [board.nonce, board.nonce.rotate_left(8), board.nonce.rotate_left(4)];
    boot.interrupt().mask(|masked| RESET_CAUSE.set(masked, board.reset_cause));
    board.tick.start(Interrupts);

    let (transmitter0, receiver0) = board.usart0.start(Interrupts);
    let (transmitter1, receiver1) = board.usart1.start(Interrupts);
    let (transmitter2, receiver2) = board.soft_uart.start(Interrupts, boot.interrupt());
    stack::RECEIVE
        .start(boot, Priority::P1, move |task| {
            let docks = [
                Incoming::new(&LINK_USART0, receiver0),
                Incoming::new(&LINK_USART1, receiver1),
                Incoming::new(&LINK_SOFT_UART, receiver2),
            ];
            receive::run::<_, Latches, _>(task, docks, &RECEIVED, &OFFICE, [seed0, seed1, seed2])
        })
        .ok()?;
    stack::SEND_USART0
        .start(boot, Priority::P2, move |task| send::run(task, &LINK_USART0, transmitter0, seed0))
        .ok()?;
    stack::SEND_USART1
        .start(boot, Priority::P2, move |task| send::run(task, &LINK_USART1, transmitter1, seed1))
        .ok()?;
    stack::SEND_SOFT_UART
        .start(boot, Priority::P2, move |task| send::run(task, &LINK_SOFT_UART, transmitter2, seed2))
        .ok()?;

    let signal = BRIDGE.mailbox().semaphore();
    let bus = board.twi.start(Interrupts, boot.interrupt(), MASTER.address, SLAVE.address, signal);
    stack::BRIDGE.start(boot, Priority::P1, move |task| bridge::run(task, &BRIDGE, bus, &OFFICE)).ok()?;

    let (rhythm, analog) = board.adc.start(Interrupts, boot.interrupt(), DEVICES.semaphore());
    let motors = Joints::new(rhythm, board.joint_pwm, board.joint_direction, board.control_probe)
        .with_roll(board.roll_pwm, board.roll_direction);
    stack::MOTORS
        .start(boot, Priority::P0, move |task| {
            let joints = joints::Joints::new([Joint::new(JOINT), Joint::new(ROLL)]);
            motor::run(task, &MOTORS, joints, motors, DEVICES.semaphore())
        })
        .ok()?;
    let peripherals: Peripherals<MasterSide> =
        Peripherals::new(analog, board.latch_pwm, board.emitters, board.charger, board.eeprom);
    stack::DEVICES
        .start(boot, Priority::P3, move |task| {
            devices::run(task, &DEVICES, peripherals, MASTER_AXES, &DESK, |task| {
                DEVICES_DUTY.promise(task, LATE);
            })
        })
        .ok()?;

    stack::INSPECTOR
        .start(boot, Priority::P7, |task| {
            let mcu = Inspected { tasks: &TASKS, counts: &COUNTS };
            let reset_cause = |task: &mut Task| task.mask(|masked| RESET_CAUSE.get(masked)).flags();
            let work = delay::cycles::<{ 1600 - inspector::ROUND }>;
            inspector::run(task, &INSPECTOR, BRIDGE.mailbox(), mcu, reset_cause, work)
        })
        .ok()?;

    #[cfg(feature = "trial")]
    trial::start(boot, board.external, Interrupts)?;

    let mut feeder = board.watchdog.start(boot);
    let api = Api::new(&OFFICE, mark);
    stack::AC_RECEIVE
        .start(boot, Priority::P4, move |task| {
            ac_receive::run(task, &AC_RECEIVE, &AC_SEND, &ADAPTIVE_COMMUNICATION, api)
        })
        .ok()?;
    stack::AC_SEND
        .start(boot, Priority::P5, move |task| ac_send::run(task, &AC_SEND, &ADAPTIVE_COMMUNICATION, api))
        .ok()?;
    stack::HORMONE
        .start(boot, Priority::P6, move |task| {
            let views = (&ADAPTIVE_COMMUNICATION, &MODULE_STATUS);
            rules::run(task, &HORMONE, GaitName::Centipede, seed0, views, api, move |task| {
                if MOTORS.is_in_time(task) && DEVICES_DUTY.is_kept(task) {
                    feeder.feed();
                }
            })
        })
        .ok()
}

/// Nothing in this image panics: code that could would not link, as the function below does not exist.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn this_image_can_panic() -> !;
    }
    // SAFETY: never linked, hence never called.
    unsafe { this_image_can_panic() }
}
