//! The slave MCU of a module: the docks Back, Up and Down, a joint, the battery, and its side of the bridge.
//!
//! This file is only wiring: the device that each task drives, and the stack that it runs on.

#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use board::Board;
use board::delay;
use board::joints::Joints;
use board::peripherals::{Latches, Peripherals, SlaveSide};
use board::reset::ResetCause;
use board::superbot::{JOINT, MASTER, SLAVE, SLAVE_AXES};
use console::inspector::{self, Counts, Inspected};
use console::task::{self as console_task, Console};
use kernel::{Boot, Context, MaskedCell, Priority, Semaphore, Stack, Task, TaskHandle};
use tasks::bridge::task::{self as bridge, Bridge};
use tasks::devices::task::{self as devices, Desk};
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

board::interrupts!(Interrupts: Tick, Usart0, Usart1, SoftUart, Twi, Adc);

// The simulator and debuggers find these by name; each begins with its counts.
#[unsafe(no_mangle)]
static LINK_USART0: Port = Port::new(SLAVE.usart0);
#[unsafe(no_mangle)]
static LINK_USART1: Port = Port::new(SLAVE.usart1);
#[unsafe(no_mangle)]
static LINK_SOFT_UART: Port = Port::new(SLAVE.timer3);
#[unsafe(no_mangle)]
static BRIDGE: Bridge = Bridge::new();
#[unsafe(no_mangle)]
static MOTORS: Motors<1> = Motors::new();
#[unsafe(no_mangle)]
static DESK: Desk<1> = Desk::new(&MOTORS, &OFFICE);
#[unsafe(no_mangle)]
static CONSOLE: Console = Console::new();

/// Posted when a dock has received something.
static RECEIVED: Semaphore = Semaphore::new(0);
/// Why the MCU started, for debuggers.
#[unsafe(no_mangle)]
static RESET_CAUSE: MaskedCell<ResetCause> = MaskedCell::new(ResetCause::NONE);

static DEVICES: Mailbox = Mailbox::new(6);
static INSPECTOR: Mailbox = Mailbox::new(1);

static OFFICE: PostOffice = PostOffice {
    router: Router::new(Mcu::Slave, RESIDENCE),
    tasks: &[(TaskCode::CONSOLE, CONSOLE.mailbox()), (TaskCode::SLAVE_INSPECTOR, &INSPECTOR)],
    devices: &DEVICES,
    links: &[
        (SLAVE.usart0, LINK_USART0.mailbox()),
        (SLAVE.usart1, LINK_USART1.mailbox()),
        (SLAVE.timer3, LINK_SOFT_UART.mailbox()),
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
    pub static MOTORS: Stack<162> = Stack::new();
    pub static DEVICES: Stack<318> = Stack::new();
    pub static BRIDGE: Stack<159> = Stack::new();
    pub static CONSOLE: Stack<615> = Stack::new();
    pub static INSPECTOR: Stack<80> = Stack::new();
}

/// All tasks, for the inspector: in the order in which the console names them.
static TASKS: [TaskHandle; 9] = [
    stack::MOTORS.task(),
    stack::RECEIVE.task(),
    stack::BRIDGE.task(),
    stack::SEND_USART0.task(),
    stack::SEND_USART1.task(),
    stack::SEND_SOFT_UART.task(),
    stack::DEVICES.task(),
    stack::CONSOLE.task(),
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
    let bus = board.twi.start(Interrupts, boot.interrupt(), SLAVE.address, MASTER.address, signal);
    stack::BRIDGE.start(boot, Priority::P1, move |task| bridge::run(task, &BRIDGE, bus, &OFFICE)).ok()?;

    let (rhythm, analog) = board.adc.start(Interrupts, boot.interrupt(), DEVICES.semaphore());
    let motors = Joints::new(rhythm, board.joint_pwm, board.joint_direction, board.control_probe);
    stack::MOTORS
        .start(boot, Priority::P0, move |task| {
            motor::run(task, &MOTORS, joints::Joints::new([Joint::new(JOINT)]), motors, DEVICES.semaphore())
        })
        .ok()?;
    stack::CONSOLE
        .start(boot, Priority::P6, |task| console_task::run(task, &CONSOLE, RESIDENCE.slave.docks, &OFFICE))
        .ok()?;
    stack::INSPECTOR
        .start(boot, Priority::P7, |task| {
            let mcu = Inspected { tasks: &TASKS, counts: &COUNTS };
            let reset_cause = |task: &mut Task| task.mask(|masked| RESET_CAUSE.get(masked)).flags();
            let work = delay::cycles::<{ 1600 - inspector::ROUND }>;
            inspector::run(task, &INSPECTOR, CONSOLE.mailbox(), mcu, reset_cause, work)
        })
        .ok()?;

    let mut feeder = board.watchdog.start(boot);
    let peripherals: Peripherals<SlaveSide> =
        Peripherals::new(analog, board.latch_pwm, board.emitters, board.charger, board.eeprom);
    stack::DEVICES
        .start(boot, Priority::P3, move |task| {
            devices::run(task, &DEVICES, peripherals, SLAVE_AXES, &DESK, move |task| {
                if MOTORS.is_in_time(task) {
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
