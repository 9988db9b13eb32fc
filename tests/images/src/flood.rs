//! A neighbour that floods a module: its one dock, at USART0, sends messages to the module's HORMONE as fast
//! as they are acknowledged. Few of them are hormones. It may also ask the module's console, again and again.

use board::Board;
use board::interrupts::Serves;
use board::tick::Tick;
use board::usart::Usart0;
use console::request::{Request, Topic, piece};
use hormone::behaviours::AdaptiveCommunication;
use hormone::gait::GaitName;
use hormone::hormone::{Data, Hormone};
use hormone::pace::Pace;
use hormone::task::Here;
use kernel::{Boot, Never, Priority, Semaphore, Stack, Task, Ticks, now};
use tasks::api::Api;
use tasks::device::NoLatches;
use tasks::dock::Dock;
use tasks::link::port::Port;
use tasks::link::receive::{self, Incoming};
use tasks::link::send;
use tasks::mailbox::Mailbox;
use tasks::message::{Address, MAX_PAYLOAD, Message, TaskCode};
use tasks::post_office::PostOffice;

/// The mailbox of devices and a bridge that do not exist.
pub static NOWHERE: Mailbox = Mailbox::new(1);

pub static AC_RECEIVE: Mailbox = Mailbox::new(4);
pub static SINK: Mailbox = Mailbox::new(4);
pub static CONSOLE: Mailbox = Mailbox::new(2);

static RECEIVED: Semaphore = Semaphore::new(0);
static RECEIVE: Stack<300> = Stack::new();
static SEND: Stack<300> = Stack::new();
static FLOOD: Stack<300> = Stack::new();
static PROBE: Stack<320> = Stack::new();
static ASK: Stack<300> = Stack::new();

/// The additional activity of such an image.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Beside {
    Nothing,
    /// It probes, so the module takes it for a neighbour.
    Probes,
    /// It asks the console.
    Asks,
}

/// The whole of such an image: `dock` is the neighbour's dock at USART0.
#[macro_export]
macro_rules! flood {
    ($dock:expr, $beside:expr) => {
        use tasks::dock::DockSet;
        use tasks::link::port::Port;
        use tasks::message::TaskCode;
        use tasks::post_office::PostOffice;
        use tasks::router::{Mcu, Residence, Residents, Router, TaskSet};
        use $crate::flood::{AC_RECEIVE, CONSOLE, NOWHERE, SINK};

        board::interrupts!(Interrupts: Tick, Usart0);

        static PORT: Port = Port::new($dock);

        const HERE: Residents = Residents {
            docks: DockSet::of(&[$dock]),
            tasks: TaskSet::of(&[TaskCode::AC_RECEIVE, TaskCode::HORMONE, TaskCode::CONSOLE]),
        };
        const OTHER: Residents = Residents { docks: DockSet::EMPTY, tasks: TaskSet::of(&[]) };

        static OFFICE: PostOffice = PostOffice {
            router: Router::new(Mcu::Master, Residence { master: HERE, slave: OTHER }),
            tasks: &[
                (TaskCode::AC_RECEIVE, &AC_RECEIVE),
                (TaskCode::HORMONE, &SINK),
                (TaskCode::CONSOLE, &CONSOLE),
            ],
            devices: &NOWHERE,
            links: &[($dock, PORT.mailbox())],
            bridge: &NOWHERE,
        };

        kernel::main!(|boot| {
            if $crate::flood::begin(boot, Interrupts, &PORT, &OFFICE, $dock, $beside).is_none() {
                board::debug::halt();
            }
        });
    };
}

/// Starts the tasks.
pub fn begin(
    boot: &mut Boot,
    interrupts: impl Serves<Tick> + Serves<Usart0> + Copy,
    port: &'static Port,
    office: &'static PostOffice,
    dock: Dock,
    beside: Beside,
) -> Option<()> {
    let board = Board::take(boot)?;
    let seed = board.nonce;
    board.tick.start(interrupts);
    let (transmitter, receiver) = board.usart0.start(interrupts);
    RECEIVE
        .start(boot, Priority::P1, move |task| {
            receive::run::<_, NoLatches, _>(task, [Incoming::new(port, receiver)], &RECEIVED, office, [seed])
        })
        .ok()?;
    SEND.start(boot, Priority::P2, move |task| send::run(task, port, transmitter, seed)).ok()?;
    let api = Api::new(office, |_| {});
    match beside {
        Beside::Nothing => {}
        Beside::Probes => PROBE.start(boot, Priority::P4, move |task| probe(task, api)).ok()?,
        Beside::Asks => ASK.start(boot, Priority::P4, move |task| ask(task, dock, api)).ok()?,
    }
    FLOOD.start(boot, Priority::P6, move |task| flood(task, dock, api)).ok()
}

/// A message of 16 bytes and its acknowledgement take 8.7 ms. So the link is busy, and yet has room for
/// probes.
const PACE: Ticks = 9;

/// One in so many messages is a hormone, by which a spine goes straight.
const HORMONE: u8 = 64;

/// AC_SEND and AC_RECV.
fn probe(task: &mut Task, api: Api) -> Never {
    let mut behaviour = AdaptiveCommunication::new(now(task));
    loop {
        while let Some(message) = AC_RECEIVE.take(task) {
            let time = now(task);
            behaviour.receive(time, &message);
        }
        let time = now(task);
        behaviour.poll(time, &mut Here { task, api });
        let time = now(task);
        AC_RECEIVE.wake_in(task, behaviour.next_due(time));
        AC_RECEIVE.wait(task);
    }
}

/// How long a piece of the console's text may take, in ticks of 1 ms.
const PATIENCE: Ticks = 400;

/// Asks for the whole text of the console, piece by piece, and begins anew at the end.
fn ask(task: &mut Task, dock: Dock, api: Api) -> Never {
    let (to, from) = (Address::beyond(dock, TaskCode::CONSOLE), Address::here(TaskCode::CONSOLE));
    let mut request = Request::Begin(Topic::All);
    loop {
        request.with_payload(|payload| {
            if let Ok(message) = Message::new(to, from, payload) {
                // A request that finds no room is sent again.
                let _ = api.send(task, message);
            }
        });
        CONSOLE.wake_in(task, PATIENCE);
        CONSOLE.wait(task);
        while let Some(letter) = CONSOLE.take(task) {
            match piece(letter.payload()) {
                Some((_, [])) | None => request = Request::Begin(Topic::All),
                Some((number, _)) => request = Request::Next(number),
            }
        }
    }
}

fn flood(task: &mut Task, dock: Dock, api: Api) -> Never {
    let to = Address::beyond(dock, TaskCode::HORMONE);
    let from = Address::here(TaskCode::HORMONE);
    let mut count = 0_u8;
    loop {
        while SINK.take(task).is_some() {}
        count = count.wrapping_add(1);
        // Each hormone has a rhythm of its own, so that the module accepts it at any time.
        let pace = Pace {
            name: GaitName::Centipede as u8,
            data: Data::A,
            is_made_good: false,
            number: count,
            rhythm: count,
            lifetime: None,
        };
        let hormone = Hormone::Pace(pace).to_payload();
        let payload = if count.is_multiple_of(HORMONE) { hormone.as_slice() } else { &[0xff; MAX_PAYLOAD] };
        if let Ok(message) = Message::new(to, from, payload) {
            // A message that finds no room is dropped: there are too many anyway.
            let _ = api.send(task, message);
        }
        task.delay(PACE);
    }
}
