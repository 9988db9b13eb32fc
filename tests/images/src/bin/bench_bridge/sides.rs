//! Two MCUs that only carry messages of 16 bytes over the bridge: either sends as fast as its bridge takes
//! them, or counts those that come in order, or does both.

use board::Board;
use board::interrupts::Serves;
use board::superbot::{MASTER, SLAVE};
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

/// The tasks that messages are for.
const RESIDENCE: Residence = Residence {
    master: Residents { docks: DockSet::EMPTY, tasks: TaskSet::of(&[TaskCode::POWER]) },
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
    tasks: &[(TaskCode::POWER, &COUNTED)],
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
static SENDER_STACK: Stack<280> = Stack::new();
static COUNTER_STACK: Stack<280> = Stack::new();

/// What a side does.
#[derive(Clone, Copy)]
pub struct Does {
    pub sends: bool,
    pub counts: bool,
}

/// Starts one side; `interrupts` proves that the vectors are there.
pub fn begin<I>(boot: &mut Boot, interrupts: I, mcu: Mcu, does: Does)
where
    I: Serves<Tick> + Serves<Twi> + Copy,
{
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(interrupts);
    let signal = BRIDGE.mailbox().semaphore();
    let (own, other, office, to) = match mcu {
        Mcu::Master => (&MASTER, &SLAVE, &MASTER_OFFICE, TaskCode::HORMONE),
        Mcu::Slave => (&SLAVE, &MASTER, &SLAVE_OFFICE, TaskCode::POWER),
    };
    let bus = board.twi.start(interrupts, boot.interrupt(), own.address, other.address, signal);
    start(BRIDGE_STACK.start(boot, Priority::P1, move |task| bridge::run(task, &BRIDGE, bus, office)));
    if does.sends {
        start(SENDER_STACK.start(boot, Priority::P3, move |task| send(task, office, Address::here(to))));
    }
    if does.counts {
        start(COUNTER_STACK.start(boot, Priority::P3, count));
    }
}

fn send(task: &mut Task, office: &PostOffice, to: Address) -> Never {
    traffic::send(task, office, to, to, 1)
}

fn count(task: &mut Task) -> Never {
    traffic::count(task, &COUNTED, Counts { in_turn: &IN_TURN, out_of_turn: &OUT_OF_TURN })
}
