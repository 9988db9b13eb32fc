//! The bridge's task, one on each MCU (paper, section 5): sends what is in its queue over I2C, and delivers
//! what comes from there.

use kernel::{Mutex, Never, Priority, Task, Ticks};

use super::protocol::{self, BridgeCounters, MAX_PACKET};
use crate::device::{Bus, Transfer};
use crate::mailbox::Mailbox;
use crate::message::Buffered;
use crate::post_office::{PostOffice, Undelivered};
use crate::router::Source;

/// Messages that may wait to cross.
const ROOM: u8 = 6;

/// How often a transfer that was refused is tried again, each time after [`PAUSE`].
const RETRY_LIMIT: u8 = 20;

/// The pause before a refused transfer is tried again, in ticks of 1 ms.
const PAUSE: Ticks = 1;

/// One side of the bridge. A `static`: its task runs on it, and readers of RAM find the [`BridgeCounters`] at its start.
#[repr(C)]
pub struct Bridge {
    counters: Mutex<BridgeCounters>,
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
        Bridge { counters: Mutex::new(Priority::P1, BridgeCounters::new()), mailbox: Mailbox::new(ROOM) }
    }

    /// Where messages to the other MCU go. The bus posts its semaphore when a transfer has ended or come in.
    pub const fn mailbox(&self) -> &Mailbox {
        &self.mailbox
    }

    /// What the bridge counts.
    pub fn counters(&self, task: &mut Task) -> BridgeCounters {
        self.counters.with(task, |counters| *counters)
    }

    fn count(&self, task: &mut Task, which: impl FnOnce(&mut BridgeCounters) -> &mut u16) {
        self.counters.with(task, |counters| {
            let counter = which(counters);
            *counter = counter.wrapping_add(1);
        });
    }
}

/// Runs the task of `bridge`.
pub fn run(
    task: &mut Task,
    bridge: &'static Bridge,
    mut bus: impl Bus,
    office: &'static PostOffice,
) -> Never {
    let mut buffer = [0; MAX_PACKET];
    let mut crossing: Option<Crossing> = None;
    loop {
        bridge.mailbox().wait(task);
        if let Some(length) = bus.receive(task, &mut buffer) {
            take(task, bridge, office, buffer.get(..length).unwrap_or(&[]));
        }
        crossing = crossing.and_then(|crossing| match bus.outcome(task) {
            None => Some(crossing),
            Some(Transfer::Done) => {
                bridge.count(task, |counters| &mut counters.messages_sent);
                None
            }
            Some(Transfer::Refused | Transfer::Fault) => {
                let again = crossing.again();
                bridge.count(task, |counters| match again {
                    Some(_) => &mut counters.retries,
                    None => &mut counters.gave_up,
                });
                if let Some(crossing) = &again {
                    task.delay(PAUSE);
                    crossing.start(task, &mut bus, &mut buffer);
                }
                again
            }
        });
        if crossing.is_none()
            && let Some(message) = bridge.mailbox().take(task)
        {
            let first = Crossing { message, retries_left: RETRY_LIMIT };
            first.start(task, &mut bus, &mut buffer);
            crossing = Some(first);
        }
    }
}

/// A message on its way to the other MCU.
struct Crossing {
    message: Buffered,
    retries_left: u8,
}

impl Crossing {
    fn start(&self, task: &mut Task, bus: &mut impl Bus, buffer: &mut [u8; MAX_PACKET]) {
        bus.send(task, protocol::encode(&self.message, buffer));
    }

    /// One retry less; nothing when none is left.
    fn again(self) -> Option<Crossing> {
        Some(Crossing { retries_left: self.retries_left.checked_sub(1)?, ..self })
    }
}

/// Delivers a message that has come in.
fn take(task: &mut Task, bridge: &'static Bridge, office: &'static PostOffice, packet: &[u8]) {
    let Ok(message) = protocol::decode(packet) else {
        return bridge.count(task, |counters| &mut counters.errors);
    };
    let delivered = office.deliver(task, message, Source::Bridge);
    bridge.count(task, |counters| match delivered {
        Ok(()) => &mut counters.messages_received,
        Err(Undelivered::NoRoom) => &mut counters.no_buffer,
        Err(Undelivered::Ignored | Undelivered::Refused) => &mut counters.ignored,
    });
}
