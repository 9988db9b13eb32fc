//! The common parts of the interrupt sweep's images: the tasks that interrupts wake, the tasks that run parts
//! of a path, and the audit after each path.
//!
//! A *path* is a stretch of kernel calls and switches between the marks [`OPEN`] and [`CLOSED`]. The sweep
//! runs it over and over, and raises interrupts anywhere in it. The tasks that they wake use the same objects
//! as the path, at other priorities. Still each path's own marks must come in the same order, and the audit
//! must find every signal, message and count in its place.

use board::debug::mark;
use core::array;
use kernel::{
    Boot, Context, EventFlags, Fifo, Interrupt, MaskedCell, Message, Mutex, Never, Pipe, Priority, Queue,
    Semaphore, Task, ThreadContext, Ticks, Timer,
};

use crate::{finish, start};

/// Begins path number `mark - OPEN`.
pub const OPEN: u8 = 0x40;
/// Ends the stretch in which the sweep raises interrupts.
pub const CLOSED: u8 = 0x60;
/// The audit is over.
pub const AUDITED: u8 = 0x61;
/// Asks the sweep for the external interrupt, as part of the path.
pub const ASK_EXTERNAL: u8 = 0x62;
/// Asks the sweep for a tick, as part of the path. The sweep also gives a tick whenever the MCU sleeps.
pub const ASK_TICK: u8 = 0x63;
/// Something is wrong. With a number added: the audit's check of that number failed.
pub const WRONG: u8 = 0xd0;

/// The sweep finds the stacks by this module's name.
pub mod stack {
    use kernel::Stack;

    pub static HIGH: Stack<104> = Stack::new();
    pub static ALARMED: Stack<96> = Stack::new();
    pub static NAPPING: Stack<156> = Stack::new();
    pub static PEER: Stack<96> = Stack::new();
    pub static RECEIVER: Stack<96> = Stack::new();
    pub static RACER: Stack<96> = Stack::new();
    pub static MIDDLE: Stack<196> = Stack::new();
    pub static TWIN: Stack<196> = Stack::new();
    pub static LOW: Stack<196> = Stack::new();
    pub static DIRECTOR: Stack<208> = Stack::new();
    /// Paths start this task, and kill it.
    pub static GUEST: Stack<176> = Stack::new();
}

// ---- What interrupts and paths both use ----------------------------------------------------------

pub struct Parcel(pub u8);
const PARCELS_IN_ALL: usize = 8;
kernel::pool!(Parcel, PARCELS_IN_ALL);

/// No task waits for it, so it stores its signals.
pub static STORE: Semaphore = Semaphore::new(0);
/// A task of priority 6 waits for it.
pub static RACE: Semaphore = Semaphore::new(0);
/// A task of priority 5 receives these.
pub static PARCELS: Queue<Parcel> = Queue::new(4);
/// No task receives these, so the queue is soon full.
pub static NOTES: Queue<Parcel> = Queue::new(2);
/// No task waits for these.
pub static SIGNS: EventFlags = EventFlags::new();
/// A task of priority 4 waits for any of these.
pub static FLAGS: EventFlags = EventFlags::new();
/// Only the audit takes these.
pub static BYTES: Fifo<8> = Fifo::new();
/// Only the audit takes these, too.
pub static PIPED: Pipe<8> = Pipe::new();
/// All tasks that lock it are at its ceiling or below.
pub static TOTAL: Mutex<u16> = Mutex::new(Priority::P1, 0);
/// A task above its ceiling locks it too.
pub static BELOW: Mutex<u16> = Mutex::new(Priority::P4, 0);

/// The flag of [`FLAGS`] and of [`SIGNS`] that the external interrupt sets; paths use the others.
pub const FLAG_OF_INTERRUPT: u8 = 1;

static PRESSED: Semaphore = Semaphore::new(0);
static DUE: Semaphore = Semaphore::new(0);
static NAP: Semaphore = Semaphore::new(0);
static QUIET: Semaphore = Semaphore::new(0);
/// Wakes a higher task.
static ALARM: Timer = Timer::new();
/// Due together with [`ALARM`], and wakes a lower task.
static ECHO: Timer = Timer::new();
static SPARE: Timer = Timer::new();

// ---- Counts for the audit ------------------------------------------------------------------------

type Count = MaskedCell<u16>;

/// More ticks than any path takes.
pub const FAR: Ticks = 1000;

/// How many ticks after its start a path's timers are due.
static UNTIL_DUE: MaskedCell<Ticks> = MaskedCell::new(0);

static EXTERNAL: Count = Count::new(0);
static HIGH_RAN: Count = Count::new(0);
static ALARMED_RAN: Count = Count::new(0);
static NAPPED_OUT: Count = Count::new(0);
static ROUSED: Count = Count::new(0);
static RACED: Count = Count::new(0);
static SENT: Count = Count::new(0);
static RECEIVED: Count = Count::new(0);
static FLAGS_SEEN: Count = Count::new(0);
static NOTED: Count = Count::new(0);
/// The refused notes since the start, as the queue counts them.
static REFUSED: Count = Count::new(0);

fn count(context: &mut impl Context, count: &Count) {
    context.mask(|masked| count.count(masked));
}

fn read(task: &mut Task, count: &Count) -> u16 {
    task.mask(|masked| count.get(masked))
}

// ---- Interrupts and what they wake ---------------------------------------------------------------

/// The handler of the external interrupt: wakes tasks of all priorities, lowest first.
pub fn external(interrupt: &mut Interrupt) {
    count(interrupt, &EXTERNAL);
    BYTES.put(interrupt, 1);
    PIPED.try_put(interrupt, 1);
    RACE.post(interrupt);
    send(interrupt);
    note(interrupt);
    SIGNS.set(interrupt, FLAG_OF_INTERRUPT);
    FLAGS.set(interrupt, FLAG_OF_INTERRUPT);
    QUIET.post(interrupt);
    PRESSED.post(interrupt);
}

/// Sends a parcel, if there is one and room for it.
pub fn send(context: &mut impl Context) {
    if let Ok(parcel) = Message::new(context, Parcel(0x5a))
        && PARCELS.send(context, parcel).is_ok()
    {
        count(context, &SENT);
    }
}

/// Sends a note, if there is a parcel for it and room.
pub fn note(context: &mut impl Context) {
    if let Ok(parcel) = Message::new(context, Parcel(0)) {
        let came = NOTES.send(context, parcel);
        count(context, if came.is_ok() { &NOTED } else { &REFUSED });
    }
}

fn high(task: &mut Task) -> Never {
    loop {
        PRESSED.wait(task);
        count(task, &HIGH_RAN);
        STORE.post(task);
        *TOTAL.lock(task) += 1;
        SPARE.start(task, FAR, &STORE);
        if !SPARE.cancel(task) {
            mark(WRONG);
        }
        send(task);
        note(task);
        *BELOW.lock(task) += 1;
    }
}

fn alarmed(task: &mut Task) -> Never {
    loop {
        DUE.wait(task);
        count(task, &ALARMED_RAN);
        STORE.post(task);
        SPARE.cancel(task);
    }
}

/// Waits for a signal from the external interrupt, with a timeout at the same tick as [`ALARM`].
fn napping(task: &mut Task) -> Never {
    loop {
        NAP.wait(task);
        let ticks = task.mask(|masked| UNTIL_DUE.get(masked));
        match QUIET.wait_timeout(task, ticks) {
            Ok(()) => count(task, &ROUSED),
            Err(_) => count(task, &NAPPED_OUT),
        }
    }
}

fn peer(task: &mut Task) -> Never {
    loop {
        let taken = FLAGS.wait_any(task, 0xff);
        task.mask(|masked| FLAGS_SEEN.set(masked, FLAGS_SEEN.get(masked) | u16::from(taken)));
    }
}

fn receiver(task: &mut Task) -> Never {
    loop {
        let parcel = PARCELS.receive(task);
        if parcel.0 != 0x5a {
            mark(WRONG);
        }
        count(task, &RECEIVED);
    }
}

fn racer(task: &mut Task) -> Never {
    loop {
        RACE.wait(task);
        raced(task);
    }
}

/// Counts a signal that was taken from [`RACE`].
pub fn raced(context: &mut impl Context) {
    count(context, &RACED);
}

// ---- Tasks that a path sends about ---------------------------------------------------------------

/// Starts the part of the path for the task of priority 4.
pub static GO_MIDDLE: Semaphore = Semaphore::new(0);
/// Starts the part of the other task of priority 4.
pub static GO_TWIN: Semaphore = Semaphore::new(0);
/// Starts the part of the task of priority 6.
pub static GO_LOW: Semaphore = Semaphore::new(0);

static PATH: MaskedCell<u8> = MaskedCell::new(0);

fn errands(
    go: &'static Semaphore,
    errand: impl Fn(&mut Task, u8) + Send + 'static,
) -> impl FnOnce(&mut Task) -> Never + Send + 'static {
    move |task| {
        loop {
            go.wait(task);
            let path = task.mask(|masked| PATH.get(masked));
            errand(task, path);
        }
    }
}

/// Starts all tasks. The director, which has the lowest priority, runs the paths; the others run their part
/// of the path whose number they get.
pub fn start_all(
    boot: &mut Boot,
    director: impl FnOnce(&mut Task) + Send + 'static,
    middle: impl Fn(&mut Task, u8) + Send + 'static,
    twin: impl Fn(&mut Task, u8) + Send + 'static,
    low: impl Fn(&mut Task, u8) + Send + 'static,
) {
    use Priority::*;
    start(stack::DIRECTOR.start(boot, P7, move |task| {
        director(task);
        finish()
    }));
    start(stack::LOW.start(boot, P6, errands(&GO_LOW, low)));
    start(stack::RACER.start(boot, P6, racer));
    start(stack::RECEIVER.start(boot, P5, receiver));
    start(stack::TWIN.start(boot, P4, errands(&GO_TWIN, twin)));
    start(stack::PEER.start(boot, P4, peer));
    start(stack::MIDDLE.start(boot, P4, errands(&GO_MIDDLE, middle)));
    start(stack::NAPPING.start(boot, P3, napping));
    start(stack::ALARMED.start(boot, P2, alarmed));
    start(stack::HIGH.start(boot, P1, high));
}

// ---- Paths and the audit -------------------------------------------------------------------------

/// The effects of a path itself, in addition to those of interrupts.
#[derive(Clone, Copy)]
pub struct Did {
    /// Signals that it left in [`STORE`].
    pub stored: i16,
    /// Signals that it gave to [`RACE`].
    pub raced: u16,
    /// The amount that it added to [`TOTAL`].
    pub total: u16,
    /// The amount that it added to [`BELOW`].
    pub below: u16,
    /// Bytes it left in [`BYTES`].
    pub bytes: i16,
    /// Bytes it left in [`PIPED`].
    pub piped: i16,
    /// Flags it set in [`FLAGS`].
    pub flags: u16,
    /// Notes it took.
    pub notes: u16,
}

/// A path without effects on objects that interrupts use.
pub const NOTHING: Did =
    Did { stored: 0, raced: 0, total: 0, below: 0, bytes: 0, piped: 0, flags: 0, notes: 0 };

/// Runs path `number`, and audits all objects.
#[inline(always)]
pub fn path(task: &mut Task, number: u8, path: impl FnOnce(&mut Task) -> Did) {
    task.mask(|masked| PATH.set(masked, number));
    prepare(task, 2);
    mark(OPEN + number);
    let did = path(task);
    close(task, did);
}

/// Ends and audits a path that [`open_at_boot`] has begun.
pub fn close(task: &mut Task, did: Did) {
    mark(CLOSED);
    audit(task, did);
    mark(AUDITED);
}

/// Begins path `number` before the kernel runs, so that the path is the kernel's start.
pub fn open_at_boot(boot: &mut Boot, number: u8) {
    prepare(boot, 1);
    mark(OPEN + number);
}

fn prepare(context: &mut impl ThreadContext, ticks: Ticks) {
    let counts = [
        &EXTERNAL,
        &HIGH_RAN,
        &ALARMED_RAN,
        &NAPPED_OUT,
        &ROUSED,
        &RACED,
        &SENT,
        &RECEIVED,
        &FLAGS_SEEN,
        &NOTED,
    ];
    for count in counts {
        context.mask(|masked| count.set(masked, 0));
    }
    context.mask(|masked| UNTIL_DUE.set(masked, ticks));
    ALARM.start(context, ticks, &DUE);
    ECHO.start(context, ticks, &RACE);
    NAP.post(context);
}

/// Makes a mark for each failed check. No other task runs meanwhile: all others are higher, and wait.
#[inline(never)]
fn audit(task: &mut Task, did: Did) {
    let external = read(task, &EXTERNAL);
    let alarms = u16::from(!ALARM.cancel(task));
    let echoes = u16::from(!ECHO.cancel(task));
    expect(task, 1, &HIGH_RAN, external);
    expect(task, 2, &ALARMED_RAN, alarms);
    expect(task, 3, &RACED, external + echoes + did.raced);
    let sent = read(task, &SENT);
    expect(task, 4, &RECEIVED, sent);
    let flag = if external > 0 { FLAG_OF_INTERRUPT } else { 0 };
    expect(task, 5, &FLAGS_SEEN, did.flags | u16::from(flag));
    check(6, SIGNS.take(task, 0xff) == flag);
    let mut notes = did.notes;
    while NOTES.try_receive(task).is_some() {
        notes += 1;
    }
    expect(task, 7, &NOTED, notes);
    let refused = NOTES.refused(task);
    expect(task, 8, &REFUSED, refused);

    QUIET.post(task); // rouses the napping task, unless it has been roused
    let roused = read(task, &ROUSED);
    let napped_out = read(task, &NAPPED_OUT);
    check(9, roused + napped_out == 1);
    check(10, drain(task, &QUIET) + roused == external + 1);
    check(11, drain(task, &STORE) as i16 == (external + alarms) as i16 + did.stored);
    check(12, core::mem::take(&mut *TOTAL.lock(task)) == external + did.total);
    check(13, core::mem::take(&mut *BELOW.lock(task)) == external + did.below);
    let mut bytes = 0;
    while BYTES.take(task).is_some() {
        bytes += 1;
    }
    check(14, bytes == external as i16 + did.bytes);
    let mut piped = 0;
    while PIPED.try_take(task).is_some() {
        piped += 1;
    }
    check(15, piped == external as i16 + did.piped);
    let all: [_; PARCELS_IN_ALL] = array::from_fn(|_| Message::new(task, Parcel(0)).ok());
    check(16, all.iter().all(Option::is_some) && Message::new(task, Parcel(0)).is_err());
}

fn expect(task: &mut Task, number: u8, count: &Count, expected: u16) {
    check(number, read(task, count) == expected);
}

fn check(number: u8, holds: bool) {
    if !holds {
        mark(WRONG + number);
    }
}

fn drain(task: &mut Task, semaphore: &Semaphore) -> u16 {
    let mut signals = 0;
    while semaphore.try_wait(task) {
        signals += 1;
    }
    signals
}
