//! A master without docks. Its one behaviour sends requests to devices, its own and the slave's, one after
//! the other.
//!
//! Marks the four bytes of each report, and waits for the next expected one.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use board::Board;
use board::debug::mark;
use board::joints::Joints;
use board::peripherals::{MasterSide, Peripherals};
use board::superbot::{JOINT, MASTER, MASTER_AXES, ROLL, SLAVE};
use kernel::{Boot, Never, Priority, Stack, Task};
use tasks::api::Api;
use tasks::bridge::task::{self as bridge, Bridge};
use tasks::devices::task::{self as devices, Desk};
use tasks::dock::Dock;
use tasks::docking::latch::End;
use tasks::mailbox::Mailbox;
use tasks::message::TaskCode;
use tasks::motor::Axis;
use tasks::motor::joint::Joint;
use tasks::motor::joints;
use tasks::motor::task::{self as motor, Motors};
use tasks::post_office::PostOffice;
use tasks::request::Request;
use tasks::router::{Mcu, Router};
use tasks::sensor::Sensor;
use tasks::superbot::RESIDENCE;
use tests_images::finish;

board::interrupts!(Interrupts: Tick, Twi, Adc);

static BRIDGE: Bridge = Bridge::new();
static MOTORS: Motors<2> = Motors::new();
static DEVICES: Mailbox = Mailbox::new(6);
static BEHAVIOUR: Mailbox = Mailbox::new(6);

static DESK: Desk<2> = Desk::new(&MOTORS, &OFFICE);
static OFFICE: PostOffice = PostOffice {
    router: Router::new(Mcu::Master, RESIDENCE),
    tasks: &[(TaskCode::HORMONE, &BEHAVIOUR)],
    devices: &DEVICES,
    links: &[],
    bridge: BRIDGE.mailbox(),
};

mod stack {
    use super::Stack;

    pub static MOTORS: Stack<250> = Stack::new();
    pub static DEVICES: Stack<400> = Stack::new();
    pub static BRIDGE: Stack<250> = Stack::new();
    pub static BEHAVIOUR: Stack<250> = Stack::new();
}

/// Sends a request, and marks the next report.
fn ask(task: &mut Task, api: Api, request: Request) {
    if api.request(task, TaskCode::HORMONE, request).is_err() {
        mark(0x7f);
    }
    hear(task);
}

/// Marks the next report.
fn hear(task: &mut Task) {
    let report = loop {
        if let Some(report) = BEHAVIOUR.take(task) {
            break report;
        }
        BEHAVIOUR.wait(task);
    };
    report.payload().iter().take(4).for_each(|byte| mark(*byte));
}

fn behave(task: &mut Task, api: Api) -> Never {
    task.delay(20); // until the slave runs too
    // All joints are off.
    for _ in Axis::ALL {
        hear(task);
    }
    // No current comes in.
    ask(task, api, Request::Charge { is_on: true });
    for code in 0..Sensor::COUNT {
        if let Some(sensor) = Sensor::from_code(code) {
            ask(task, api, Request::Read(sensor));
        }
    }
    for dock in [Dock::Right, Dock::Back] {
        ask(task, api, Request::Latch(dock, End::Latched));
    }
    // The reports are of switches that trip.
    for dock in [Dock::Left, Dock::Down] {
        ask(task, api, Request::Power { dock, is_on: true });
    }
    for axis in Axis::ALL {
        ask(task, api, Request::Turn { axis, angle: 100, speed: 60 });
    }
    ask(task, api, Request::Approach(Dock::Front));
    ask(task, api, Request::Approach(Dock::Front));
    // The battery empties.
    for _ in 0..2 {
        hear(task);
    }
    ask(task, api, Request::Latch(Dock::Left, End::Latched));
    // A neighbour supplies power, and then stops: the charger gives up, and the switch opens. At first the
    // switch waits, for the battery is on the other MCU.
    if api.request(task, TaskCode::HORMONE, Request::Charge { is_on: true }).is_err() {
        mark(0x7f);
    }
    ask(task, api, Request::Power { dock: Dock::Left, is_on: true });
    for _ in 0..3 {
        hear(task);
    }
    finish()
}

kernel::main!(|boot| {
    if begin(boot).is_none() {
        mark(0x7e);
        finish();
    }
});

fn begin(boot: &mut Boot) -> Option<()> {
    let board = Board::take(boot)?;
    board.tick.start(Interrupts);
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
            devices::run(task, &DEVICES, peripherals, MASTER_AXES, &DESK, |_| {})
        })
        .ok()?;
    let api = Api::new(&OFFICE, |_| {});
    stack::BEHAVIOUR.start(boot, Priority::P4, move |task| behave(task, api)).ok()
}
