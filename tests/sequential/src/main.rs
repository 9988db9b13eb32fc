//! The master MCU of a module as a sequential program: one loop that checks every part in turn. It uses the
//! drivers, links, control, topology and rules of `firmware-master`, and does the same.
//!
//! Bytes, I2C and conversions are interrupt-fed, as in the firmware. The loop is the kernel's only task. It
//! never blocks: it takes the signals that drivers have posted, compares deadlines with the clock, and sleeps
//! by itself. So the kernel has nothing to schedule.
//!
//! The loop checks the joints' control, which has to be done within a millisecond, between any two other
//! parts. The slave is `firmware-slave`.

#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

mod behaviours;
mod devices;
mod due;
mod joints;
mod sending;
#[cfg(feature = "trial")]
mod trial;

use board::Board;
use board::debug::mark;
use board::joints::Joints;
use board::peripherals::{Latches, MasterSide, Peripherals};
use board::serial::{Receiver, has_sent};
use board::sleep::sleep_unless;
use board::soft_uart::SoftUart;
use board::superbot::{JOINT, MASTER, MASTER_AXES, ROLL, SLAVE};
use board::usart::{Usart0, Usart1};
use board::watchdog::Feeder;
use hormone::gait::GaitName;
use hormone::status::Status;
use kernel::{Boot, Context, Interrupt, Mutex, Never, Priority, Semaphore, Stack, Task, is_reached, now};
use tasks::api::Api;
use tasks::bridge::task::Bridge;
use tasks::devices::task::Desk;
use tasks::link::port::Port;
use tasks::link::receive::Incoming;
use tasks::mailbox::Mailbox;
use tasks::message::TaskCode;
use tasks::motor::joint::Joint;
use tasks::motor::task::Motors;
use tasks::post_office::PostOffice;
use tasks::router::{Mcu, Router};
use tasks::superbot::RESIDENCE;

use behaviours::{Hormones, Neighbours};
use devices::{Bridging, Serving};
use due::{Parts, Times};
use joints::Driver;
use sending::Sending;

#[cfg(not(feature = "trial"))]
board::interrupts!(Interrupts: Tick, Usart0, Usart1, SoftUart, Twi, Adc);
#[cfg(feature = "trial")]
board::interrupts!(Interrupts: Tick, Usart0, Usart1, SoftUart, Twi, Adc, External);

// The simulator finds these by name, as in the firmware.
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
static DESK: Desk<2> = Desk::new(&MOTORS, &OFFICE);
#[unsafe(no_mangle)]
static MODULE_STATUS: Mutex<Status> = Mutex::new(Priority::P0, Status::POWER_UP);

/// Posted when something has come in at a dock.
static RECEIVED: Semaphore = Semaphore::new(0);
static DEVICES: Mailbox = Mailbox::new(6);
static AC_RECEIVE: Mailbox = Mailbox::new(6);
static HORMONE: Mailbox = Mailbox::new(8);

static OFFICE: PostOffice = PostOffice {
    router: Router::new(Mcu::Master, RESIDENCE),
    tasks: &[(TaskCode::AC_RECEIVE, &AC_RECEIVE), (TaskCode::HORMONE, &HORMONE)],
    devices: &DEVICES,
    links: &[
        (MASTER.usart0, LINK_USART0.mailbox()),
        (MASTER.usart1, LINK_USART1.mailbox()),
        (MASTER.timer3, LINK_SOFT_UART.mailbox()),
    ],
    bridge: BRIDGE.mailbox(),
};

/// The stack of the loop, in bytes. `./x bench concurrency` fails when it needs more.
mod stack {
    const BYTES: usize = if cfg!(feature = "trial") { 1042 } else { 1028 };
    pub static LOOP: super::Stack<BYTES> = super::Stack::new();
}

kernel::main!(|boot| {
    if start(boot).is_none() {
        board::debug::halt();
    }
});

/// Starts the loop. `None` if it can't be started.
fn start(boot: &mut Boot) -> Option<()> {
    let board = Board::take(boot)?;
    stack::LOOP.start(boot, Priority::P0, move |task| run(task, board)).ok()
}

/// Starts the devices, and gives all parts their turns for ever.
fn run(task: &mut Task, board: Board) -> Never {
    let seeds = [board.nonce, board.nonce.rotate_left(8), board.nonce.rotate_left(4)];
    board.tick.start(Interrupts);
    let (transmitter0, receiver0) = board.usart0.start(Interrupts);
    let (transmitter1, receiver1) = board.usart1.start(Interrupts);
    let (transmitter2, receiver2) = board.soft_uart.start(Interrupts, task);
    let [seed0, seed1, seed2] = seeds;
    let mut incoming = [
        Incoming::new(&LINK_USART0, receiver0),
        Incoming::new(&LINK_USART1, receiver1),
        Incoming::new(&LINK_SOFT_UART, receiver2),
    ];
    for (dock, seed) in incoming.iter_mut().zip(seeds) {
        dock.begin(task, &RECEIVED, seed);
    }
    let mut outgoing = [
        Sending::new(&LINK_USART0, transmitter0, seed0),
        Sending::new(&LINK_USART1, transmitter1, seed1),
        Sending::new(&LINK_SOFT_UART, transmitter2, seed2),
    ];

    let signal = BRIDGE.mailbox().semaphore();
    let bus = board.twi.start(Interrupts, task, MASTER.address, SLAVE.address, signal);
    let mut bridge = Bridging::new(&BRIDGE, bus, &OFFICE);

    let (rhythm, analog) = board.adc.start(Interrupts, task, DEVICES.semaphore());
    let motors = Joints::new(rhythm, board.joint_pwm, board.joint_direction, board.control_probe)
        .with_roll(board.roll_pwm, board.roll_direction);
    let mut joints = Driver::new(&MOTORS, [Joint::new(JOINT), Joint::new(ROLL)], motors, DEVICES.semaphore());
    let peripherals: Peripherals<MasterSide> =
        Peripherals::new(analog, board.latch_pwm, board.emitters, board.charger, board.eeprom);
    let mut devices = Serving::new(task, &DEVICES, peripherals, MASTER_AXES, &DESK);

    let api = Api::new(&OFFICE, mark);
    let mut neighbours = Neighbours::new(task, &AC_RECEIVE, api);
    let mut hormones = Hormones::new(task, &HORMONE, GaitName::Centipede, seed0, &MODULE_STATUS, api);

    #[cfg(feature = "trial")]
    let mut trial = trial::Trial::new(task, board.external, Interrupts);
    let mut feeder = board.watchdog.start(task);
    let mut times = Times::new(now(task));
    loop {
        let due = wait(task, &mut times, &mut feeder);
        if due.has(Parts::JOINTS.and(Parts::ORDERED).and(Parts::PERIOD)) {
            let next = joints.turn(task, due.has(Parts::ORDERED), due.has(Parts::PERIOD));
            times.set(Parts::JOINTS, next);
        }
        // Called between any two other parts, because the joints' control has to be done within a
        // millisecond.
        let mut keep_up = |task: &mut Task, times: &mut Times| {
            if MOTORS.period().try_wait(task) {
                times.set(Parts::JOINTS, joints.turn(task, false, true));
            }
        };
        if due.has(Parts::RECEIVED) {
            for dock in &mut incoming {
                receive(task, dock);
                keep_up(task, &mut times);
            }
        }
        if due.has(Parts::BRIDGE) {
            times.set(Parts::BRIDGE, bridge.turn(task));
            keep_up(task, &mut times);
        }
        for (dock, &(part, sent)) in outgoing.iter_mut().zip(&SENDING) {
            if due.has(part.and(sent)) {
                times.set(part, dock.turn(task, due.has(sent)));
                keep_up(task, &mut times);
            }
        }
        if due.has(Parts::DEVICES) {
            times.set(Parts::DEVICES, devices.turn(task));
            keep_up(task, &mut times);
        }
        if due.has(Parts::NEIGHBOURS) {
            times.set(Parts::NEIGHBOURS, neighbours.turn(task));
            keep_up(task, &mut times);
        }
        if due.has(Parts::HORMONES) {
            times.set(Parts::HORMONES, hormones.turn(task, neighbours.malformed()));
            neighbours.expect(hormones.beats());
            keep_up(task, &mut times);
        }
        #[cfg(feature = "trial")]
        if due.has(Parts::TRIAL.and(Parts::EDGE)) {
            times.set(Parts::TRIAL, trial.turn(task, due.has(Parts::EDGE)));
            keep_up(task, &mut times);
        }
    }
}

/// The part of each sending half, and the signal that a frame has left.
static SENDING: [(Parts, Parts); 3] =
    [(Parts::SENDING0, Parts::SENT0), (Parts::SENDING1, Parts::SENT1), (Parts::SENDING2, Parts::SENT2)];

/// Takes the frames that have come in at a dock.
#[inline(never)] // its stack is needed here alone
fn receive(task: &mut Task, dock: &mut Incoming<Receiver>) {
    dock.receive::<Latches>(task, &OFFICE);
}

/// Sleeps until a part is due. Returns all parts that are.
#[inline(never)] // its stack is needed here alone
fn wait(task: &mut Task, times: &mut Times, feeder: &mut Feeder) -> Parts {
    let next = times.next;
    loop {
        feeder.feed();
        let mut due = Parts::NONE;
        let mut is_time = false;
        let has_work = |interrupt: &mut Interrupt| {
            due = posted(interrupt);
            is_time = is_reached(next, now(interrupt));
            due.is_any() || is_time
        };
        // SAFETY: taking signals and reading the clock makes no task ready.
        unsafe { sleep_unless(task, has_work) };
        if due.is_any() || is_time {
            return due.and(times.reached(now(task)));
        }
    }
}

/// Takes one signal of each posted semaphore. Returns the parts.
#[inline(always)] // it also runs with interrupts masked
fn posted(context: &mut impl Context) -> Parts {
    let posted = Parts::NONE
        .with(Parts::PERIOD, MOTORS.period(), context)
        .with(Parts::ORDERED, MOTORS.ordered(), context)
        .with(Parts::RECEIVED, &RECEIVED, context)
        .with(Parts::BRIDGE, BRIDGE.mailbox().semaphore(), context)
        .with(Parts::SENDING0, LINK_USART0.mailbox().semaphore(), context)
        .with(Parts::SENDING1, LINK_USART1.mailbox().semaphore(), context)
        .with(Parts::SENDING2, LINK_SOFT_UART.mailbox().semaphore(), context)
        .and_if(Parts::SENT0, has_sent::<Usart0>(context))
        .and_if(Parts::SENT1, has_sent::<Usart1>(context))
        .and_if(Parts::SENT2, has_sent::<SoftUart>(context))
        .with(Parts::DEVICES, DEVICES.semaphore(), context)
        .with(Parts::NEIGHBOURS, AC_RECEIVE.semaphore(), context)
        .with(Parts::HORMONES, HORMONE.semaphore(), context);
    #[cfg(feature = "trial")]
    let posted = posted.with(Parts::EDGE, &trial::EDGE, context);
    posted
}

/// Nothing in this image panics: if some code could, the linker would miss this function.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn this_image_can_panic() -> !;
    }
    // SAFETY: never linked, hence never called.
    unsafe { this_image_can_panic() }
}
