//! The registers, the interrupt, and what the bridge task calls.

use avr_device::atmega128a::TWI;
use kernel::{Context, Interrupt, Masked, MaskedCell, Semaphore, Task};
use tasks::device::{Bus, Transfer};

use super::engine::{CAPACITY, Data, Engine};
use crate::interrupts::Serves;
use crate::superbot::{CLOCK_HZ, I2C_HZ};

/// TWBR for a prescaler of 1: SCL has 16 + 2 * TWBR clocks (ATmega128 datasheet, "Bit Rate Generator Unit").
const BIT_RATE: u8 = {
    let bit_rate = (CLOCK_HZ / I2C_HZ - 16) / 2;
    assert!(bit_rate >= 10 && bit_rate <= 255, "as a master the interface needs a TWBR from 10 to 255");
    bit_rate as u8
};

/// TWCR: the interface and its interrupt are on.
const ENABLED: u8 = 1 << 2 | 1 << 0; // TWEN, TWIE
/// TWCR: send a STOP as a master, let go of the bus otherwise.
const STOP: u8 = 1 << 4; // TWSTO
/// TWCR: send a START when the bus is free.
const START: u8 = 1 << 5; // TWSTA
/// TWCR: acknowledge.
const ACKNOWLEDGE: u8 = 1 << 6; // TWEA
/// TWCR: there is a new status. Writing one clears it, and the interface goes on.
const INTERRUPT: u8 = 1 << 7; // TWINT

/// TWSR: the status, without the prescaler bits.
const STATUS: u8 = 0xf8;

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

fn registers() -> TWI {
    // SAFETY: there is one `Interface`, and it shares these registers with the interrupt alone. TWCR, which
    // both write, is written with interrupts masked.
    unsafe { TWI::steal() }
}

fn set_control(_: &Masked, bits: u8) {
    // SAFETY: the interface touches no memory, whatever its registers hold.
    registers().twcr().write(|w| unsafe { w.bits(bits) });
}

/// Sets `bits`, and leaves a status that waits for its answer, and a STOP that is under way, as they are.
fn request(masked: &Masked, bits: u8) {
    set_control(masked, registers().twcr().read().bits() & !INTERRUPT | bits);
}

/// The two-wire serial interface: SCL = PD0, SDA = PD1.
pub struct Twi(());

impl Twi {
    pub(crate) const fn new() -> Self {
        Twi(())
    }

    /// Starts the interface at [`I2C_HZ`], for packets to the MCU with the 7-bit address `other`, and from
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
        registers().twbr().write(|w| w.set(BIT_RATE));
        // SAFETY: any address will do. Bit 0 is clear: the general call is not recognised.
        registers().twar().write(|w| unsafe { w.bits(own << 1) });
        context.mask(|masked| {
            SHARED.destination.set(masked, other << 1);
            SHARED.signal.set(masked, Some(signal));
            set_control(masked, ENABLED | ACKNOWLEDGE);
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

/// The interrupt "Two-wire Serial Interface".
#[doc(hidden)]
#[inline(always)]
pub fn status_changed(interrupt: &mut Interrupt) {
    let signal = interrupt.mask(|masked| {
        let registers = registers();
        let status = registers.twsr().read().bits() & STATUS;
        let (answer, mut control) = SHARED.with_engine(masked, |engine| {
            let answer = engine.answer(status);
            let start = if engine.wants_start() { START } else { 0 };
            let acknowledge = if engine.acknowledges() { ACKNOWLEDGE } else { 0 };
            (answer, ENABLED | INTERRUPT | start | acknowledge)
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
                    cell.set(masked, registers.twdr().read().bits());
                }
                None
            }
        };
        if let Some(byte) = byte {
            registers.twdr().write(|w| w.set(byte));
        }
        set_control(masked, control);
        if answer.signals { SHARED.signal.get(masked) } else { None }
    });
    if let Some(signal) = signal {
        signal.post(interrupt);
    }
}
