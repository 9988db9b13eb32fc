//! Two MCUs with nothing to do but to carry messages of 16 bytes over one link, at USART0: one sends as fast as the link
//! takes them, the other counts those that come.

use board::Board;
use board::interrupts::Serves;
use board::superbot::MASTER;
use board::tick::Tick;
use board::usart::Usart0;
use kernel::{Boot, Context, MaskedCell, Never, Priority, Stack, Task};
use tasks::dock::DockSet;
use tasks::link::port::Port;
use tasks::link::{receive, send};
use tasks::mailbox::Mailbox;
use tasks::message::{Address, MAX_PAYLOAD, Message, TaskCode};
use tasks::post_office::PostOffice;
use tasks::router::{Mcu, Residence, Residents, Router, Source, TaskSet};
use tests_images::start;

/// One dock, and one task that can be addressed.
const RESIDENTS: Residents =
    Residents { docks: DockSet::of(&[MASTER.usart0]), tasks: TaskSet::of(&[TaskCode::HORMONE]) };
const NONE: Residents = Residents { docks: DockSet::EMPTY, tasks: TaskSet::of(&[]) };

#[unsafe(no_mangle)]
static LINK: Port = Port::new(MASTER.usart0);
/// Messages that came in turn, and that did not.
#[unsafe(no_mangle)]
static IN_TURN: MaskedCell<u16> = MaskedCell::new(0);
#[unsafe(no_mangle)]
static OUT_OF_TURN: MaskedCell<u16> = MaskedCell::new(0);

static COUNTED: Mailbox = Mailbox::new(4);
/// There is neither another MCU nor any device but the link.
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
    start(RECEIVE.start(boot, Priority::P1, move |task| receive::run(task, &LINK, receiver, &OFFICE, seed)));
    start(SEND.start(boot, Priority::P2, move |task| send::run(task, &LINK, transmitter, seed)));
    start(TASK.start(boot, Priority::P4, move |task| if is_sender { fill(task) } else { count(task) }));
}

fn fill(task: &mut Task) -> Never {
    let to = Address::beyond(MASTER.usart0, TaskCode::HORMONE);
    let from = Address::here(TaskCode::HORMONE);
    let mut number = 0u8;
    loop {
        if let Ok(message) = Message::new(to, from, &[number; MAX_PAYLOAD]) {
            match OFFICE.deliver(task, message, Source::Task) {
                Ok(()) => number = number.wrapping_add(1),
                Err(_) => task.delay(5), // the link has all it can hold
            }
        }
    }
}

fn count(task: &mut Task) -> Never {
    let mut number = 0u8;
    loop {
        COUNTED.wait(task);
        while let Some(message) = COUNTED.take(task) {
            let is_in_turn = message.payload() == [number; MAX_PAYLOAD];
            number = message.payload().first().map_or(0, |number| number.wrapping_add(1));
            let counted = if is_in_turn { &IN_TURN } else { &OUT_OF_TURN };
            task.mask(|masked| counted.set(masked, counted.get(masked).wrapping_add(1)));
        }
    }
}
