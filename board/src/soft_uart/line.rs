//! The device: what its tasks call, and its interrupts.

use kernel::{Context, Interrupt, Masked, MaskedCell, Task};

use super::decoder::{Character, EdgeDecoder};
use super::encoder::{Pulse, PulseEncoder};
use super::registers;
use crate::interrupts::Serves;
use crate::serial::{Line, Port, Receiver, Transmitter};
use crate::superbot::{BAUD, CLOCK_HZ};

/// A bit in clocks: 417.
const BIT: u16 = {
    let bit = (CLOCK_HZ + BAUD / 2) / BAUD;
    assert!(bit <= 0xffff / 12, "a character and more must fit the timer");
    bit as u16
};

/// Clocks from the call to the first start bit: the first pulse must be set by then.
const LEAD: u16 = BIT;

static STATE: MaskedCell<State> = MaskedCell::new(State::Listening);
static DECODER: MaskedCell<EdgeDecoder<BIT>> = MaskedCell::new(EdgeDecoder::new());
static ENCODER: MaskedCell<PulseEncoder<BIT>> = MaskedCell::new(PulseEncoder::new());

/// What the timer is used for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Listening,
    Sending,
}

/// The UART in software: received at PE7, sent at PE5. It uses Timer3, INT5 and INT7.
pub struct SoftUart(());

impl SoftUart {
    pub(crate) const fn new() -> Self {
        SoftUart(())
    }

    /// Starts the line at [`BAUD`].
    pub fn start(self, _: impl Serves<SoftUart>, context: &mut impl Context) -> (Transmitter, Receiver) {
        context.mask(|_| registers::start());
        (Transmitter::of::<SoftUart>(), Receiver::of::<SoftUart>())
    }
}

impl Line for SoftUart {
    #[inline(always)]
    fn port() -> &'static Port {
        static PORT: Port = Port::new();
        &PORT
    }

    fn begin(task: &mut Task) {
        let mut encoder = PulseEncoder::new();
        let Some((byte, _)) = task.mask(|masked| Self::port().next(masked)) else { return };
        encoder.begin(byte);
        let first = encoder.next(|| task.mask(next_byte));
        task.mask(|masked| {
            STATE.set(masked, State::Sending);
            ENCODER.set(masked, encoder);
            registers::begin_pulses(LEAD);
            set_pulse(first);
        });
    }
}

fn next_byte(masked: &Masked) -> Option<u8> {
    SoftUart::port().next(masked).map(|(byte, _)| byte)
}

#[inline(always)]
fn set_pulse(pulse: Option<Pulse>) {
    match pulse {
        Some(Pulse { low, length, is_last: false }) => registers::set_pulse(low, length),
        Some(Pulse { low, length, is_last: true }) => registers::set_last_pulse(low, length),
        None => {}
    }
}

/// INT5: a pulse has begun, so the next one can be set.
#[doc(hidden)]
#[inline(always)]
pub fn pulse_begun() {
    in_handler(|masked| {
        let mut encoder = ENCODER.get(masked);
        let pulse = encoder.next(|| next_byte(masked));
        ENCODER.set(masked, encoder);
        set_pulse(pulse);
    });
}

/// INT7: the line has changed.
#[doc(hidden)]
#[inline(always)]
pub fn edge_received() {
    in_handler(|masked| {
        let mut decoder = DECODER.get(masked);
        let mut is_high = !registers::expects_rising();
        let mut start = None;
        if let Some(time) = registers::captured() {
            is_high = !is_high;
            start = decoder.edge(time, is_high);
        }
        if is_high != registers::is_high() {
            is_high = !is_high;
            start = decoder.untimed_edge(is_high).or(start);
        }
        registers::expect(!is_high);
        DECODER.set(masked, decoder);
        if let Some(start) = start {
            registers::set_match_b(start.wrapping_add(EdgeDecoder::<BIT>::END));
            if !decoder.is_behind() {
                registers::forget_match_b();
            }
            registers::watch_match_b();
        }
    });
}

/// "Timer/Counter3 Compare Match B": a character has ended, or the last one's stop bit is on the wire.
#[doc(hidden)]
#[inline(always)]
pub fn ended(interrupt: &mut Interrupt) {
    let character = interrupt.mask(|masked| {
        let mut decoder = DECODER.get(masked);
        let character = match STATE.get(masked) {
            State::Listening => decoder.ended(!registers::expects_rising()),
            State::Sending => {
                decoder = EdgeDecoder::new();
                registers::listen();
                None
            }
        };
        DECODER.set(masked, decoder);
        if !decoder.is_busy() {
            registers::ignore_match_b();
        }
        character
    });
    match character {
        Some(Character::Byte(byte)) => SoftUart::port().put(interrupt, byte),
        Some(Character::Malformed) => SoftUart::port().lose(interrupt),
        None => {}
    }
    let is_sent = interrupt.mask(|masked| {
        let state = STATE.get(masked);
        STATE.set(masked, State::Listening);
        state == State::Sending
    });
    if is_sent {
        SoftUart::port().finish(interrupt);
    }
}

/// Runs `body` in a handler that is no interrupt to the kernel.
#[inline(always)]
fn in_handler(body: impl FnOnce(&Masked)) {
    // SAFETY: a handler runs with interrupts masked. No kernel call follows that may make a task ready.
    unsafe { Interrupt::assume() }.mask(body);
}
