//! The bridge's task, one on each MCU (paper, section 5): sends what is in its queue over I2C, and delivers
//! what comes from there.

use kernel::{Never, Task, Ticks, now};

use super::protocol::{self, BridgeCounters, MAX_PACKET};
use crate::counter::{self, Counter};
use crate::device::{Bus, Transfer};
use crate::mailbox::Mailbox;
use crate::post_office::{PostOffice, Undelivered};
use crate::router::Source;

/// Messages that may wait to cross.
pub const ROOM: u8 = 6;

/// How often a transfer that failed is tried again.
const RETRY_LIMIT: u8 = 20;

/// The pause before that, in ticks of 1 ms.
const PAUSE: Ticks = 1;

/// How long a transfer may take, in ticks of 1 ms. The longest takes 0.6 ms, and as much again behind the
/// other MCU's; the rest is for what both MCUs have to do besides.
const TRANSFER_AT_MOST: Ticks = 5;

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
        // SAFETY: it is so.
        unsafe { counter::all(&self.counters) }
    }

    /// What the bridge counts.
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
    let mut incoming = [0; MAX_PACKET];
    let mut next = Next::new();
    let mut sending = Sending { phase: Phase::Idle, retries_left: 0, deadline: 0 };
    loop {
        bridge.mailbox().wait(task);
        // The bus first, which is idle while it waits for this task.
        let outcome = bus.outcome(task);
        sending.look_after(task, bridge, &mut bus, outcome);
        if sending.phase == Phase::Idle {
            next.prepare(task, bridge);
            if let Some(packet) = next.take() {
                bus.send(task, packet);
                sending.begin(task);
            }
        }
        if let Some(length) = bus.receive(task, &mut incoming) {
            take(task, bridge, office, incoming.get(..length).unwrap_or(&[]));
        }
        if sending.phase == Phase::Idle {
            bridge.mailbox().cancel_alarm(task);
            continue;
        }
        next.prepare(task, bridge);
        let left = sending.left(task);
        if sending.phase == Phase::OnBus {
            // The alarm of the packet before rings before this one's, and is set anew then.
            bridge.mailbox().wake_within(task, left);
        } else {
            bridge.mailbox().wake_in(task, left);
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing is to be sent.
    Idle,
    /// A packet is on the bus, or waits for it.
    OnBus,
    /// It failed, and is sent again after a while.
    Pausing,
}

/// The packet that is under way to the other MCU.
struct Sending {
    phase: Phase,
    retries_left: u8,
    /// When it has taken too long, or is sent again.
    deadline: Ticks,
}

impl Sending {
    fn begin(&mut self, task: &mut Task) {
        self.retries_left = RETRY_LIMIT;
        self.enter(task, Phase::OnBus, TRANSFER_AT_MOST);
    }

    fn enter(&mut self, task: &mut Task, phase: Phase, ticks: Ticks) {
        self.phase = phase;
        self.deadline = now(task).wrapping_add(ticks);
    }

    /// How many ticks are left until the deadline; at least one.
    fn left(&self, task: &mut Task) -> Ticks {
        self.deadline.wrapping_sub(now(task)).clamp(1, TRANSFER_AT_MOST)
    }

    fn is_due(&self, task: &mut Task) -> bool {
        // A deadline that has passed lies far ahead.
        self.deadline.wrapping_sub(now(task)).wrapping_sub(1) >= TRANSFER_AT_MOST
    }

    /// Counts an `outcome`, and does what failures and time ask for.
    fn look_after(
        &mut self,
        task: &mut Task,
        bridge: &'static Bridge,
        bus: &mut impl Bus,
        outcome: Option<Transfer>,
    ) {
        match outcome {
            Some(Transfer::Done) => {
                self.phase = Phase::Idle;
                bridge.counters.messages_sent.count(task);
            }
            Some(Transfer::Refused | Transfer::Fault) => self.fail(task, bridge),
            None if self.phase == Phase::Idle || !self.is_due(task) => {}
            None if self.phase == Phase::OnBus => {
                bus.free(task);
                bridge.counters.freed.count(task);
                self.fail(task, bridge);
            }
            None => {
                bus.send_again(task);
                self.enter(task, Phase::OnBus, TRANSFER_AT_MOST);
            }
        }
    }

    fn fail(&mut self, task: &mut Task, bridge: &'static Bridge) {
        match self.retries_left.checked_sub(1) {
            Some(left) => {
                self.retries_left = left;
                self.enter(task, Phase::Pausing, PAUSE);
                bridge.counters.retries.count(task);
            }
            None => {
                self.phase = Phase::Idle;
                bridge.counters.gave_up.count(task);
            }
        }
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
    #[inline(never)] // it is called twice
    fn prepare(&mut self, task: &mut Task, bridge: &'static Bridge) {
        if self.length == 0
            && let Some(message) = bridge.mailbox().take(task)
        {
            self.length = protocol::encode(message.message(), &mut self.packet).len();
        }
    }

    fn take(&mut self) -> Option<&[u8]> {
        let length = core::mem::take(&mut self.length);
        self.packet.get(..length).filter(|packet| !packet.is_empty())
    }
}

/// Delivers a message that has come in.
fn take(task: &mut Task, bridge: &'static Bridge, office: &'static PostOffice, packet: &[u8]) {
    let Ok(message) = protocol::decode(packet) else {
        return bridge.counters.errors.count(task);
    };
    let delivered = office.deliver(task, message, Source::Bridge);
    let counter = match delivered {
        Ok(()) => &bridge.counters.messages_received,
        Err(Undelivered::NoRoom) => &bridge.counters.no_buffer,
        Err(Undelivered::Ignored | Undelivered::Refused) => &bridge.counters.ignored,
    };
    counter.count(task);
}
