//! The bridge's task, one on each MCU (paper, section 5): sends what is in its queue over I2C, and delivers
//! what comes from there.

use kernel::{Never, Task, Ticks, now};

use super::protocol::{self, BridgeCounters, MAX_PACKET};
use super::sender::{RETRY_LIMIT, Sender, Step};
use crate::counter::Counter;
use crate::device::{Bus, Transfer};
use crate::mailbox::Mailbox;
use crate::post_office::{PostOffice, Undelivered};
use crate::router::Source;

/// Messages that may wait to cross.
pub const ROOM: u8 = 6;

/// How often the bridge tries to deliver a message to a task, at most a tick apart. The other MCU tries as
/// often to send the next one.
const TRIES: u8 = RETRY_LIMIT;

/// One side of the bridge. A `static`: its task runs on it, and readers of RAM find the [`BridgeCounters`] at
/// its start.
#[repr(C)]
pub struct Bridge {
    counters: BridgeCounters<Counter>,
    mailbox: Mailbox,
}

impl Default for Bridge {
    fn default() -> Self {
        Self::new()
    }
}

impl Bridge {
    /// This MCU's side.
    pub const fn new() -> Self {
        Bridge { counters: BridgeCounters::new(), mailbox: Mailbox::new(ROOM) }
    }

    /// Where messages to the other MCU go. The bus posts its semaphore when a transfer has ended or come in.
    pub const fn mailbox(&self) -> &Mailbox {
        &self.mailbox
    }

    /// Its counts, in the order of [`BridgeCounters`].
    pub const fn counts(&self) -> &[Counter] {
        self.counters.all()
    }

    /// The bridge's counts.
    pub fn counters(&self, task: &mut Task) -> BridgeCounters {
        self.counters.read(task)
    }
}

/// Runs the task of `bridge`.
pub fn run(
    task: &mut Task,
    bridge: &'static Bridge,
    mut bus: impl Bus,
    office: &'static PostOffice,
) -> Never {
    let mut arrived = Arrived::new();
    let mut next = Next::new();
    let mut sender = Sender::new();
    loop {
        bridge.mailbox().wait(task);
        match turn(task, bridge, &mut bus, office, (&mut arrived, &mut next, &mut sender)) {
            None => bridge.mailbox().cancel_alarm(task),
            // An alarm left from the previous packet rings before this one's is due, and is set anew then.
            Some(left) if sender.is_on_bus() => bridge.mailbox().wake_within(task, left),
            Some(left) => bridge.mailbox().wake_in(task, left),
        }
    }
}

/// The traffic of a bridge, both ways, for a caller that drives it without [`run`].
pub struct Crossing {
    arrived: Arrived,
    next: Next,
    sender: Sender,
}

impl Crossing {
    /// Nothing crosses yet.
    pub const fn new() -> Self {
        Crossing { arrived: Arrived::new(), next: Next::new(), sender: Sender::new() }
    }

    /// Does all that there is to do. Call it after each signal of the bridge's mailbox, and after as many
    /// ticks as it returns.
    #[inline(always)] // a frame of its own would take stack
    pub fn turn(
        &mut self,
        task: &mut Task,
        bridge: &'static Bridge,
        bus: &mut impl Bus,
        office: &'static PostOffice,
    ) -> Option<Ticks> {
        turn(task, bridge, bus, office, (&mut self.arrived, &mut self.next, &mut self.sender))
    }
}

/// One turn. It takes the parts of a [`Crossing`], because they are faster as locals of the task.
#[inline(always)]
fn turn(
    task: &mut Task,
    bridge: &'static Bridge,
    bus: &mut impl Bus,
    office: &'static PostOffice,
    (arrived, next, sender): (&mut Arrived, &mut Next, &mut Sender),
) -> Option<Ticks> {
    // The bus comes first: it is idle while it waits for this task.
    let outcome = bus.outcome(task);
    look_after(task, bridge, bus, sender, outcome);
    if sender.is_idle() {
        next.prepare(task, bridge);
        if let Some(packet) = next.take() {
            bus.send(task, packet);
            sender.begin(now(task));
        }
    }
    if arrived.take(task, bridge, bus, office) {
        return Some(1);
    }
    let left = sender.poll_in(now(task))?;
    next.prepare(task, bridge);
    Some(left)
}

impl Default for Crossing {
    fn default() -> Self {
        Self::new()
    }
}

/// Does what follows from an `outcome`, or from the time, and counts it.
fn look_after(
    task: &mut Task,
    bridge: &'static Bridge,
    bus: &mut impl Bus,
    sender: &mut Sender,
    mut outcome: Option<Transfer>,
) {
    let counters = &bridge.counters;
    loop {
        let step = sender.poll(now(task), outcome);
        let counter = match step {
            Step::Nothing => return,
            Step::SendAgain => return bus.send_again(task),
            Step::Arrived => &counters.messages_sent,
            Step::Failed => &counters.retries,
            Step::GaveUp => &counters.gave_up,
            Step::Free => {
                bus.free(task);
                &counters.freed
            }
        };
        counter.count(task);
        if step != Step::Free {
            return;
        }
        outcome = bus.outcome(task).or(Some(Transfer::Fault));
    }
}

/// The packet to be sent next. It is made while the one before is on the wire.
struct Next {
    packet: [u8; MAX_PACKET],
    /// 0 if there is none.
    length: usize,
}

impl Next {
    const fn new() -> Next {
        Next { packet: [0; MAX_PACKET], length: 0 }
    }

    /// Makes a packet of the first message that waits, unless there is one already.
    #[inline(always)]
    fn prepare(&mut self, task: &mut Task, bridge: &'static Bridge) {
        if self.length == 0 {
            self.make(task, bridge);
        }
    }

    #[inline(never)] // it is called twice
    fn make(&mut self, task: &mut Task, bridge: &'static Bridge) {
        if let Some(message) = bridge.mailbox().take(task) {
            self.length = protocol::encode(message.message(), &mut self.packet).len();
        }
    }

    fn take(&mut self) -> Option<&[u8]> {
        let length = core::mem::take(&mut self.length);
        self.packet.get(..length).filter(|packet| !packet.is_empty())
    }
}

/// The packet that has come in last.
struct Arrived {
    packet: [u8; MAX_PACKET],
    length: u8,
    /// The tries left to deliver it; 0 if that is done.
    tries_left: u8,
}

impl Arrived {
    const fn new() -> Arrived {
        Arrived { packet: [0; MAX_PACKET], length: 0, tries_left: 0 }
    }

    /// Delivers what has come in. Returns whether to look again soon: a message waits for room, or the one
    /// that has waited may have kept another one back. One for a dock does not wait: its line may be busy for
    /// long.
    #[inline(always)]
    fn take(
        &mut self,
        task: &mut Task,
        bridge: &'static Bridge,
        bus: &mut impl Bus,
        office: &'static PostOffice,
    ) -> bool {
        let has_waited = self.tries_left > 0;
        if !has_waited {
            let Some(length) = bus.receive(task, &mut self.packet) else { return false };
            (self.length, self.tries_left) = (length as u8, TRIES);
        }
        let packet = self.packet.get(..usize::from(self.length)).unwrap_or(&[]);
        self.tries_left = deliver(task, bridge, office, packet, self.tries_left - 1);
        has_waited || self.tries_left > 0
    }
}

/// Delivers a message that has come in. Returns the tries left if it is to wait, else 0.
#[inline(always)]
fn deliver(
    task: &mut Task,
    bridge: &'static Bridge,
    office: &'static PostOffice,
    packet: &[u8],
    tries_left: u8,
) -> u8 {
    let Ok(message) = protocol::decode(packet) else {
        bridge.counters.errors.count(task);
        return 0;
    };
    let counter = match office.deliver(task, message, Source::Bridge) {
        Ok(()) => &bridge.counters.messages_received,
        Err(Undelivered::NoRoom) if message.to().dock().is_none() && tries_left > 0 => return tries_left,
        Err(Undelivered::NoRoom) => &bridge.counters.no_buffer,
        Err(Undelivered::Ignored | Undelivered::Refused) => &bridge.counters.ignored,
    };
    counter.count(task);
    0
}
