//! Packets: what the bridge task calls, and the interrupt.

use kernel::{Context, Interrupt, Masked, MaskedCell, Semaphore, Task};
use tasks::device::{Bus, Transfer};

use super::engine::{CAPACITY, Data, Engine};
use super::registers::{
    ACKNOWLEDGE, ENABLED, INTERRUPT, START, STOP, data, request, set_bit_rate, set_control, set_data,
    set_own_address, status,
};
use super::stream::{self, Stream};
use crate::interrupts::Serves;

/// What the task and the interrupt share.
struct Shared {
    engine: MaskedCell<Engine>,
    outgoing: [MaskedCell<u8>; CAPACITY],
    incoming: [MaskedCell<u8>; CAPACITY],
    /// SLA+W of the other MCU.
    destination: MaskedCell<u8>,
    signal: MaskedCell<Option<&'static Semaphore>>,
}

static SHARED: Shared = Shared {
    engine: MaskedCell::new(Engine::new()),
    outgoing: [const { MaskedCell::new(0) }; CAPACITY],
    incoming: [const { MaskedCell::new(0) }; CAPACITY],
    destination: MaskedCell::new(0),
    signal: MaskedCell::new(None),
};

impl Shared {
    #[inline(always)]
    fn with_engine<R>(&self, masked: &Masked, body: impl FnOnce(&mut Engine) -> R) -> R {
        let mut engine = self.engine.get(masked);
        let result = body(&mut engine);
        self.engine.set(masked, engine);
        result
    }
}

/// The two-wire serial interface: SCL = PD0, SDA = PD1.
pub struct Twi(());

impl Twi {
    pub(crate) const fn new() -> Self {
        Twi(())
    }

    /// Starts the interface at [`I2C_HZ`](crate::superbot::I2C_HZ), for packets to the MCU with the 7-bit address `other`, and from
    /// whoever calls the address `own`. `signal` is posted when a packet was sent, or could not be, and when
    /// one has come.
    pub fn start(
        self,
        _: impl Serves<Twi>,
        context: &mut impl Context,
        own: u8,
        other: u8,
        signal: &'static Semaphore,
    ) -> Interface {
        set_bit_rate();
        set_own_address(own);
        context.mask(|masked| {
            SHARED.destination.set(masked, other << 1);
            SHARED.signal.set(masked, Some(signal));
            request(masked, ENABLED | ACKNOWLEDGE);
        });
        Interface(())
    }
}

/// The running interface.
pub struct Interface(());

impl Bus for Interface {
    /// While a transfer is under way, or its outcome was not taken, `bytes` are ignored.
    fn send(&mut self, task: &mut Task, bytes: &[u8]) {
        if !task.mask(|masked| SHARED.engine.get(masked).is_idle()) {
            return;
        }
        // Byte by byte, so that interrupts are never masked for long: in this state the interrupt reads none.
        let mut length = 0;
        for (cell, byte) in SHARED.outgoing.iter().zip(bytes) {
            task.mask(|masked| cell.set(masked, *byte));
            length += 1;
        }
        task.mask(|masked| {
            SHARED.with_engine(masked, |engine| engine.send(length));
            request(masked, START);
        });
    }

    fn outcome(&mut self, task: &mut Task) -> Option<Transfer> {
        task.mask(|masked| SHARED.with_engine(masked, Engine::outcome))
    }

    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> Option<usize> {
        let length = task.mask(|masked| SHARED.engine.get(masked).received())?;
        let mut copied = 0;
        for (slot, cell) in buffer.iter_mut().zip(&SHARED.incoming).take(usize::from(length)) {
            *slot = task.mask(|masked| cell.get(masked));
            copied += 1;
        }
        task.mask(|masked| {
            SHARED.with_engine(masked, Engine::release);
            request(masked, ACKNOWLEDGE);
        });
        Some(copied)
    }
}

/// The interrupt "Two-wire Serial Interface" in a program with packets alone.
#[doc(hidden)]
#[inline(always)]
pub fn status_changed(interrupt: &mut Interrupt) {
    answer(interrupt, status(), false);
}

/// The state of the packets.
#[inline(always)]
pub(super) fn engine(masked: &Masked) -> Engine {
    SHARED.engine.get(masked)
}

/// Answers `status`. `transaction_waits`: whether one wants the bus when no packet has it.
#[inline(always)]
pub(super) fn answer(interrupt: &mut Interrupt, status: u8, transaction_waits: bool) {
    let signal = interrupt.mask(|masked| {
        let (answer, mut control) = SHARED.with_engine(masked, |engine| {
            let sent = stream::OUTGOING.get(masked).index(&SHARED.outgoing);
            let received = stream::INCOMING.get(masked).index(&SHARED.incoming);
            engine.catch_up(sent, received);
            let answer = engine.answer(status);
            let start = if engine.wants_start() { START } else { 0 };
            let others_start = if transaction_waits && !engine.is_sending() { START } else { 0 };
            let acknowledge = if engine.acknowledges() { ACKNOWLEDGE } else { 0 };
            let (next, sendable) = engine.sendable();
            stream::OUTGOING.set(masked, Stream::new(&SHARED.outgoing, next, sendable));
            let (next, storable) = engine.storable();
            stream::INCOMING.set(masked, Stream::new(&SHARED.incoming, next, storable));
            (answer, ENABLED | INTERRUPT | start | others_start | acknowledge)
        });
        if answer.stops {
            control |= STOP;
        }
        let byte = match answer.data {
            Data::None => None,
            Data::Address => Some(SHARED.destination.get(masked)),
            Data::Send(index) => SHARED.outgoing.get(usize::from(index)).map(|cell| cell.get(masked)),
            Data::Ones => Some(0xff),
            Data::Store(index) => {
                if let Some(cell) = SHARED.incoming.get(usize::from(index)) {
                    cell.set(masked, data());
                }
                None
            }
        };
        if let Some(byte) = byte {
            set_data(byte);
        }
        set_control(masked, control);
        if answer.signals { SHARED.signal.get(masked) } else { None }
    });
    if let Some(signal) = signal {
        signal.post(interrupt);
    }
}
