//! The device: what its tasks call, and its interrupts.

use kernel::{Context, Interrupt, Masked, MaskedCell, Task};

use super::decoder::{Character, EdgeDecoder};
use super::encoder::{Pulse, PulseEncoder};
use super::registers;
use crate::interrupts::Serves;
use crate::serial::{Line, Port, Receiver, Transmitter};
use crate::superbot::{BAUD, CLOCK_HZ};

/// A bit in clocks: 417.
#[doc(hidden)]
pub const BIT: u16 = {
    let bit = (CLOCK_HZ + BAUD / 2) / BAUD;
    assert!(bit <= 0xffff / 12, "a character and more must fit the timer");
    bit as u16
};

/// Clocks from a character's beginning until it has ended for certain.
#[doc(hidden)]
pub const END: u16 = EdgeDecoder::<BIT>::END;

/// Clocks from the call to the first start bit: the first pulse must be set by then.
const LEAD: u16 = BIT;

static STATE: MaskedCell<State> = MaskedCell::new(State::Listening);
#[doc(hidden)]
pub static DECODER: MaskedCell<EdgeDecoder<BIT>> = MaskedCell::new(EdgeDecoder::new());
#[doc(hidden)]
pub static ENCODER: MaskedCell<PulseEncoder<BIT>> = MaskedCell::new(PulseEncoder::new());

/// What tasks and interrupts share.
#[doc(hidden)]
pub static PORT: Port = Port::new();

/// What the timer is used for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Listening,
    Sending,
    /// Listening again, and the task that sent is to be woken.
    HasSent,
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
        &PORT
    }

    fn begin(task: &mut Task) -> bool {
        let mut encoder = PulseEncoder::new();
        let Some((byte, _)) = task.mask(|masked| PORT.next(masked)) else { return false };
        encoder.begin(byte);
        let first = encoder.next(|| task.mask(next_byte));
        task.mask(|masked| {
            if DECODER.get(masked).is_busy() {
                return false;
            }
            STATE.set(masked, State::Sending);
            DECODER.set(masked, EdgeDecoder::new()); // what comes in is drowned
            ENCODER.set(masked, encoder);
            registers::begin_pulses(LEAD);
            set_pulse(first);
            true
        })
    }
}

fn next_byte(masked: &Masked) -> Option<u8> {
    PORT.next(masked).map(|(byte, _)| byte)
}

#[inline(always)]
fn set_pulse(pulse: Option<Pulse>) {
    match pulse {
        Some(Pulse { low, length, is_last: false }) => registers::set_pulse(low, length),
        Some(Pulse { low, length, is_last: true }) => registers::set_last_pulse(low, length),
        None => {}
    }
}

/// "Timer/Counter3 Compare Match A": a byte is in store that wakes the task; or the transmission has ended.
#[doc(hidden)]
#[inline(always)]
pub fn wake(interrupt: &mut Interrupt) {
    let has_sent = interrupt.mask(|masked| {
        registers::ignore_match_a();
        let has_sent = STATE.get(masked) == State::HasSent;
        if has_sent {
            STATE.set(masked, State::Listening);
        }
        has_sent
    });
    if has_sent { PORT.finish(interrupt) } else { PORT.wake(interrupt) }
}

/// "Timer/Counter3 Compare Match B", where it is no byte that follows another: a byte after a pause or a line held low, or the
/// last stop bit that is sent is on the wire.
#[doc(hidden)]
#[inline(always)]
pub fn ended(interrupt: &mut Interrupt) {
    let ended = interrupt.mask(|masked| {
        registers::ignore_match_b();
        if STATE.get(masked) == State::Sending {
            registers::listen();
            registers::raise_match_a();
            STATE.set(masked, State::HasSent);
            return None;
        }
        let mut decoder = DECODER.get(masked);
        let ended = decoder.ended(!registers::expects_rising());
        DECODER.set(masked, decoder);
        ended
    });
    match ended {
        Some(Character::Byte(byte)) => PORT.put(interrupt, byte),
        Some(Character::Malformed) => PORT.lose(interrupt),
        None => {}
    }
}
