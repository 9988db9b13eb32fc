//! Packets: the functions for the bridge task, and the interrupt.

use kernel::{Context, Interrupt, Masked, MaskedCell, Semaphore, Task};
use tasks::device::{Bus, Transfer};

use super::control::{ACKNOWLEDGE, ENABLED, GO_ON, HELD, INTERRUPT, START, STOP};
use super::engine::{CAPACITY, Data, Engine};
use super::registers::{data, request, set_bit_rate, set_control, set_data, set_own_address, status, twsr};
use super::stream::{Ended, Streams};
use super::under_way;
use super::wires::{self, Wire};
use crate::deferred::{self, Serving, source};
use crate::guarded::Guarded;
use crate::interrupts::Serves;
use crate::period;

/// What the task and the interrupt share.
struct Packets {
    engine: MaskedCell<Engine>,
    /// SLA+W of the other MCU, and the bytes for it.
    outgoing: [MaskedCell<u8>; 1 + CAPACITY],
    /// The number of bytes in the outgoing packet, the address among them.
    length: MaskedCell<u8>,
    incoming: [MaskedCell<u8>; CAPACITY],
    signal: MaskedCell<Option<&'static Semaphore>>,
}

static PACKETS: Packets = Packets {
    engine: MaskedCell::new(Engine::new()),
    outgoing: [const { MaskedCell::new(0) }; 1 + CAPACITY],
    length: MaskedCell::new(0),
    incoming: [const { MaskedCell::new(0) }; CAPACITY],
    signal: MaskedCell::new(None),
};

/// What the vector may send and store without the engine.
static STREAMS: Guarded<Streams> = Guarded::new(Streams::new());

impl Packets {
    /// Tells the engine what has ended without it.
    #[inline(always)]
    fn settle(&'static self, masked: &Masked) {
        if let Some(ended) = STREAMS.get(masked).take_ended() {
            self.settle_with(masked, ended);
        }
    }

    /// [`settle`](Self::settle) as a function call, for less frequent callers.
    #[inline(never)]
    fn settle_by_call(&'static self, masked: &Masked) {
        self.settle(masked);
    }

    /// Not inlined, so that all callers share one copy.
    #[inline(never)]
    fn settle_with(&'static self, masked: &Masked, ended: Ended) {
        let mut engine = self.engine.get(masked);
        STREAMS.get(masked).catch_up(&mut engine);
        engine.settle(ended.sent, ended.is_received);
        self.engine.set(masked, engine);
    }

    /// Does with TWDR what an answer requires.
    #[inline(always)]
    fn obey(&'static self, masked: &Masked, what: Data) {
        match what {
            Data::None => {}
            Data::Send(index) => {
                if let Some(cell) = self.outgoing.get(usize::from(index)) {
                    set_data(cell.get(masked));
                }
            }
            Data::Ones => set_data(0xff),
            Data::Store(index) => {
                if let Some(cell) = self.incoming.get(usize::from(index)) {
                    cell.set(masked, data());
                }
            }
        }
    }
}

/// The two-wire serial interface: SCL = PD0, SDA = PD1.
pub struct Twi(());

impl Twi {
    pub(crate) const fn new() -> Self {
        Twi(())
    }

    /// Starts the interface at [`I2C_HZ`](crate::superbot::I2C_HZ), for packets to the MCU with the 7-bit
    /// address `other`, and from any master that addresses this one as `own`. `signal` is posted when a
    /// packet was sent, or could not be, and when one was received.
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
            if let Some(address) = PACKETS.outgoing.first() {
                address.set(masked, other << 1);
            }
            STREAMS.get(masked).arm_incoming(&Engine::new());
            PACKETS.signal.set(masked, Some(signal));
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
        if !task.mask(|masked| PACKETS.engine.get(masked).is_idle()) {
            return;
        }
        let [_, cells @ ..] = &PACKETS.outgoing;
        // All at once, 8 cycles a byte: the bus waits for this, and byte by byte it would take 10.
        task.mask(|masked| {
            for (cell, byte) in cells.iter().zip(bytes) {
                cell.set(masked, *byte);
            }
        });
        task.mask(|masked| PACKETS.length.set(masked, 1 + bytes.len().min(CAPACITY) as u8));
        self.send_again(task);
    }

    /// While a transfer is under way, or its outcome was not taken, nothing happens.
    fn send_again(&mut self, task: &mut Task) {
        task.mask(|masked| {
            let length = PACKETS.length.get(masked);
            let mut engine = PACKETS.engine.get(masked);
            if engine.is_idle() {
                engine.send(length);
                PACKETS.engine.set(masked, engine);
                STREAMS.get(masked).arm_outgoing(&engine);
                request(masked, START);
            }
        });
    }

    /// Gives pulses on SCL until SDA is high, nine at most: a slave that holds SDA low for a bit of a byte
    /// has reached the end of it by then (I2C-bus specification, "Bus clear"). The STOP that follows tells
    /// all devices that the bus is free.
    fn free(&mut self, task: &mut Task) {
        task.mask(|masked| {
            deferred::withdraw(masked, source::TWI);
            set_control(masked, 0); // the pins belong to the port, which releases them
        });
        for _ in 0..9 {
            if wires::data_is_high() {
                break;
            }
            wires::pull(task, Wire::Clock, true);
            wires::pull(task, Wire::Clock, false);
        }
        wires::pull(task, Wire::Clock, true);
        wires::pull(task, Wire::Data, true);
        wires::pull(task, Wire::Clock, false);
        wires::pull(task, Wire::Data, false);
        let ends_transaction = task.mask(|masked| {
            STREAMS.get(masked).end_incoming();
            PACKETS.settle_by_call(masked);
            let mut engine = PACKETS.engine.get(masked);
            engine.reset();
            PACKETS.engine.set(masked, engine);
            STREAMS.get(masked).arm(&engine);
            let acknowledge = if engine.acknowledges() { ACKNOWLEDGE } else { 0 };
            // A status from before the interface was switched off may still wait for its answer.
            set_control(masked, ENABLED | INTERRUPT | acknowledge);
            under_way::break_off(masked)
        });
        if ends_transaction {
            under_way::wake(task);
        }
    }

    fn outcome(&mut self, task: &mut Task) -> Option<Transfer> {
        task.mask(|masked| PACKETS.settle(masked));
        task.mask(|masked| {
            let mut engine = PACKETS.engine.get(masked);
            let outcome = engine.outcome();
            PACKETS.engine.set(masked, engine);
            outcome
        })
    }

    fn receive(&mut self, task: &mut Task, buffer: &mut [u8]) -> Option<usize> {
        task.mask(|masked| PACKETS.settle_by_call(masked));
        let length = usize::from(task.mask(|masked| PACKETS.engine.get(masked).received())?);
        // Byte by byte, too: a complete packet stays so until it is released.
        for (slot, cell) in buffer.iter_mut().zip(&PACKETS.incoming).take(length) {
            *slot = task.mask(|masked| cell.get(masked));
        }
        task.mask(|masked| {
            let mut engine = PACKETS.engine.get(masked);
            engine.release();
            PACKETS.engine.set(masked, engine);
            STREAMS.get(masked).arm_incoming(&engine);
            request(masked, ACKNOWLEDGE);
        });
        Some(length.min(buffer.len()))
    }
}

/// The interrupt "Two-wire Serial Interface" in a program with packets alone. It does not enter the kernel.
#[doc(hidden)]
#[inline(always)]
pub fn status_changed(masked: &Masked) {
    let streams = STREAMS.get(masked);
    match streams.answer(twsr()) {
        Some(what) => {
            PACKETS.obey(masked, what);
            set_control(masked, GO_ON);
            streams.advance(what); // only now that the bus goes on
        }
        None => {
            set_control(masked, HELD);
            deferred::raise(masked, source::TWI);
        }
    }
}

/// Answers the status for which the bus is held.
#[doc(hidden)]
#[inline(always)]
pub fn serve(serving: &mut Serving) {
    let status = status();
    serving.window();
    let turned = serving.interrupt.mask(|masked| {
        let streams = STREAMS.get(masked);
        set_control(masked, streams.turn(status)?);
        period::begin_if_due_by_call(masked); // the kernel takes as long again
        Some(if streams.has_ended() { PACKETS.signal.get(masked) } else { None })
    });
    serving.window();
    let signal = turned.unwrap_or_else(|| {
        settle(serving.interrupt);
        serving.window();
        let signal = answer(serving.interrupt, status, false);
        serving.window();
        signal
    });
    if let Some(signal) = signal {
        signal.post(serving.interrupt);
    }
}

/// The state of the packets.
#[inline(always)]
pub(super) fn engine(masked: &Masked) -> Engine {
    PACKETS.engine.get(masked)
}

/// Tells the engine what has ended without it.
#[inline(always)]
pub(super) fn settle(interrupt: &mut Interrupt) {
    interrupt.mask(|masked| PACKETS.settle_by_call(masked));
}

/// Answers `status`, after what has ended was [settled](settle). `transaction_waits` is whether a transaction
/// wants the bus if no packet has it. Returns the semaphore to post.
#[inline(always)]
pub(super) fn answer(
    interrupt: &mut Interrupt,
    status: u8,
    transaction_waits: bool,
) -> Option<&'static Semaphore> {
    interrupt.mask(|masked| {
        let mut engine = PACKETS.engine.get(masked);
        STREAMS.get(masked).catch_up(&mut engine);
        let answer = engine.answer(status);
        PACKETS.obey(masked, answer.data);
        let others_start = transaction_waits && !engine.is_sending();
        let start = if engine.wants_start() || others_start { START } else { 0 };
        let acknowledge = if engine.acknowledges() { ACKNOWLEDGE } else { 0 };
        let stop = if answer.stops { STOP } else { 0 };
        set_control(masked, ENABLED | INTERRUPT | start | acknowledge | stop);
        // The bus goes on, and the vector waits for this handler.
        PACKETS.engine.set(masked, engine);
        STREAMS.get(masked).arm(&engine);
        if answer.signals { PACKETS.signal.get(masked) } else { None }
    })
}
