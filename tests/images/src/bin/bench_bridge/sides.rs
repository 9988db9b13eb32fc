//! Two MCUs that only carry messages of 16 bytes over the bridge: one sends as fast as its bridge takes them,
//! the other counts those that come in order.

use board::Board;
use board::interrupts::Serves;
use board::superbot::Half;
use board::tick::Tick;
use board::twi::Twi;
use kernel::{Boot, MaskedCell, Never, Priority, Stack, Task};
use tasks::bridge::task::{self as bridge, Bridge};
use tasks::dock::DockSet;
use tasks::mailbox::Mailbox;
use tasks::message::{Address, TaskCode};
use tasks::post_office::PostOffice;
use tasks::router::{Mcu, Residence, Residents, Router, TaskSet};
use tests_images::start;
use tests_images::traffic::{self, Counts};

/// The one task that can be addressed is on the slave.
const RESIDENCE: Residence = Residence {
    master: Residents { docks: DockSet::EMPTY, tasks: TaskSet::of(&[]) },
    slave: Residents { docks: DockSet::EMPTY, tasks: TaskSet::of(&[TaskCode::HORMONE]) },
};

#[unsafe(no_mangle)]
static BRIDGE: Bridge = Bridge::new();
/// Messages that came in order, and that did not.
#[unsafe(no_mangle)]
static IN_TURN: MaskedCell<u16> = MaskedCell::new(0);
#[unsafe(no_mangle)]
static OUT_OF_TURN: MaskedCell<u16> = MaskedCell::new(0);

static COUNTED: Mailbox = Mailbox::new(4);
/// There are no devices.
static NOWHERE: Mailbox = Mailbox::new(1);

static MASTER_OFFICE: PostOffice = PostOffice {
    router: Router::new(Mcu::Master, RESIDENCE),
    tasks: &[],
    devices: &NOWHERE,
    links: &[],
    bridge: BRIDGE.mailbox(),
};
static SLAVE_OFFICE: PostOffice = PostOffice {
    router: Router::new(Mcu::Slave, RESIDENCE),
    tasks: &[(TaskCode::HORMONE, &COUNTED)],
    devices: &NOWHERE,
    links: &[],
    bridge: BRIDGE.mailbox(),
};

static BRIDGE_STACK: Stack<280> = Stack::new();
static TASK_STACK: Stack<280> = Stack::new();

/// Starts one side; `interrupts` proves that the vectors are there.
pub fn begin<I>(boot: &mut Boot, interrupts: I, mcu: Mcu, own: &Half, other: &Half)
where
    I: Serves<Tick> + Serves<Twi> + Copy,
{
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(interrupts);
    let signal = BRIDGE.mailbox().semaphore();
    let bus = board.twi.start(interrupts, boot.interrupt(), own.address, other.address, signal);
    let office = match mcu {
        Mcu::Master => &MASTER_OFFICE,
        Mcu::Slave => &SLAVE_OFFICE,
    };
    start(BRIDGE_STACK.start(boot, Priority::P1, move |task| bridge::run(task, &BRIDGE, bus, office)));
    start(match mcu {
        Mcu::Master => TASK_STACK.start(boot, Priority::P3, send),
        Mcu::Slave => TASK_STACK.start(boot, Priority::P3, count),
    });
}

fn send(task: &mut Task) -> Never {
    let to = Address::here(TaskCode::HORMONE);
    traffic::send(task, &MASTER_OFFICE, to, to, 1)
}

fn count(task: &mut Task) -> Never {
    traffic::count(task, &COUNTED, Counts { in_turn: &IN_TURN, out_of_turn: &OUT_OF_TURN })
}
