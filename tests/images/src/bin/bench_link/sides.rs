//! Two MCUs that only carry messages of 16 bytes over one link, at USART0: one sends as fast as the link
//! takes them, the other counts those that come.

use board::Board;
use board::interrupts::Serves;
use board::superbot::MASTER;
use board::tick::Tick;
use board::usart::Usart0;
use kernel::{Boot, MaskedCell, Never, Priority, Semaphore, Stack, Task};
use tasks::device::NoLatches;
use tasks::dock::DockSet;
use tasks::link::port::Port;
use tasks::link::receive::{self, Incoming};
use tasks::link::send;
use tasks::mailbox::Mailbox;
use tasks::message::{Address, TaskCode};
use tasks::post_office::PostOffice;
use tasks::router::{Mcu, Residence, Residents, Router, TaskSet};
use tests_images::start;
use tests_images::traffic::{self, Counts};

/// One dock, and one task that can be addressed.
const RESIDENTS: Residents =
    Residents { docks: DockSet::of(&[MASTER.usart0]), tasks: TaskSet::of(&[TaskCode::HORMONE]) };
const NONE: Residents = Residents { docks: DockSet::EMPTY, tasks: TaskSet::of(&[]) };

#[unsafe(no_mangle)]
static LINK: Port = Port::new(MASTER.usart0);
/// Messages that came in order, and that did not.
#[unsafe(no_mangle)]
static IN_TURN: MaskedCell<u16> = MaskedCell::new(0);
#[unsafe(no_mangle)]
static OUT_OF_TURN: MaskedCell<u16> = MaskedCell::new(0);

static RECEIVED: Semaphore = Semaphore::new(0);
static COUNTED: Mailbox = Mailbox::new(4);
/// There is neither another MCU nor any device except the link.
static NOWHERE: Mailbox = Mailbox::new(1);

static OFFICE: PostOffice = PostOffice {
    router: Router::new(Mcu::Master, Residence { master: RESIDENTS, slave: NONE }),
    tasks: &[(TaskCode::HORMONE, &COUNTED)],
    devices: &NOWHERE,
    links: &[(MASTER.usart0, LINK.mailbox())],
    bridge: &NOWHERE,
};

static RECEIVE: Stack<280> = Stack::new();
static SEND: Stack<280> = Stack::new();
static TASK: Stack<280> = Stack::new();

/// Starts one side; `interrupts` proves that the vectors are there.
pub fn begin<I>(boot: &mut Boot, interrupts: I, is_sender: bool)
where
    I: Serves<Tick> + Serves<Usart0> + Copy,
{
    let Some(board) = Board::take(boot) else { return };
    let seed = board.nonce;
    board.tick.start(interrupts);
    let (transmitter, receiver) = board.usart0.start(interrupts);
    start(RECEIVE.start(boot, Priority::P1, move |task| {
        receive::run::<_, NoLatches, _>(task, [Incoming::new(&LINK, receiver)], &RECEIVED, &OFFICE, [seed])
    }));
    start(SEND.start(boot, Priority::P2, move |task| send::run(task, &LINK, transmitter, seed)));
    start(TASK.start(boot, Priority::P4, move |task| if is_sender { fill(task) } else { count(task) }));
}

fn fill(task: &mut Task) -> Never {
    let to = Address::beyond(MASTER.usart0, TaskCode::HORMONE);
    traffic::send(task, &OFFICE, to, Address::here(TaskCode::HORMONE), 5)
}

fn count(task: &mut Task) -> Never {
    traffic::count(task, &COUNTED, Counts { in_turn: &IN_TURN, out_of_turn: &OUT_OF_TURN })
}
