//! The bridge's task, one on each MCU (paper, section 5): sends what is in its queue over I2C, and delivers
//! what comes from there.

use kernel::{Mutex, Never, Priority, Task, Ticks};

use super::protocol::{self, BridgeCounters, MAX_PACKET};
use crate::device::{Bus, Transfer};
use crate::mailbox::Mailbox;
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
    let mut incoming = [0; MAX_PACKET];
    let mut next = Next::new();
    let mut retries_left: Option<u8> = None; // of the transfer under way
    loop {
        bridge.mailbox().wait(task);
        // The bus first, which is idle while it waits for this task.
        let received = bus.receive(task, &mut incoming);
        let outcome = bus.outcome(task);
        match outcome {
            None => {}
            Some(Transfer::Done) => retries_left = None,
            Some(Transfer::Refused | Transfer::Fault) => {
                retries_left = retries_left.and_then(|left| left.checked_sub(1));
                if retries_left.is_some() {
                    task.delay(PAUSE);
                    bus.send_again(task);
                }
            }
        }
        if retries_left.is_none() {
            next.prepare(task, bridge);
            if let Some(packet) = next.take() {
                bus.send(task, packet);
                retries_left = Some(RETRY_LIMIT);
            }
        }
        if let Some(outcome) = outcome {
            bridge.count(task, |counters| match outcome {
                Transfer::Done => &mut counters.messages_sent,
                _ => &mut counters.retries,
            });
        }
        if let Some(length) = received {
            take(task, bridge, office, incoming.get(..length).unwrap_or(&[]));
        }
        next.prepare(task, bridge);
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
    fn prepare(&mut self, task: &mut Task, bridge: &'static Bridge) {
        if self.length == 0
            && let Some(message) = bridge.mailbox().take(task)
        {
            self.length = protocol::encode(&message, &mut self.packet).len();
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
        return bridge.count(task, |counters| &mut counters.errors);
    };
    let delivered = office.deliver(task, message, Source::Bridge);
    bridge.count(task, |counters| match delivered {
        Ok(()) => &mut counters.messages_received,
        Err(Undelivered::NoRoom) => &mut counters.no_buffer,
        Err(Undelivered::Ignored | Undelivered::Refused) => &mut counters.ignored,
    });
}
