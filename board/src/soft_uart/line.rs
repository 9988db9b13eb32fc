//! The device: the functions for its tasks, and its interrupts.

use kernel::{Context, Masked, MaskedCell, Task};

use super::decoder::{Character, EdgeDecoder};
use super::encoder::{Pulse, PulseEncoder};
use super::{BIT, registers};
use crate::deferred::{self, Serving, source};
use crate::guarded::Guarded;
use crate::interrupts::Serves;
use crate::period;
use crate::serial::{Line, Port, Receiver, Transmitter};
#[cfg(doc)]
use crate::superbot::BAUD;

/// Clocks from the call to the first start bit: the first pulse must be set by then.
const LEAD: u16 = BIT;

/// Whether the timer makes pulses. Otherwise it captures the times of edges.
static IS_SENDING: MaskedCell<bool> = MaskedCell::new(false);
static DECODER: Guarded<EdgeDecoder> = Guarded::new(EdgeDecoder::new());
static ENCODER: Guarded<PulseEncoder<BIT>> = Guarded::new(PulseEncoder::new());

/// What tasks and interrupts share.
#[doc(hidden)]
pub static PORT: Port = Port::new();

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
        let Some(byte) = task.mask(next_byte) else { return false };
        // The first pulse is made of a copy, so that interrupts are not masked meanwhile.
        let encoder = PulseEncoder::new();
        encoder.begin(byte);
        let first = encoder.next(|| task.mask(next_byte));
        task.mask(|masked| {
            let decoder = DECODER.get(masked);
            if decoder.is_busy() {
                return false;
            }
            IS_SENDING.set(masked, true);
            decoder.reset(); // a character that comes in is drowned
            ENCODER.get(masked).go_on_from(&encoder);
            registers::begin_pulses(LEAD);
            set_pulse(first);
            true
        })
    }
}

#[inline(always)]
fn next_byte(masked: &Masked) -> Option<u8> {
    PORT.next(masked).map(|(byte, _)| byte)
}

/// Sets the pulse that follows the present one, if there is one.
#[inline(always)]
fn set_pulse(pulse: Option<Pulse>) {
    match pulse {
        Some(Pulse { low, length, is_last: false }) => registers::set_pulse(low, length),
        Some(Pulse { low, length, is_last: true }) => registers::set_last_pulse(low, length),
        None => {}
    }
}

/// The interrupt INT5: a pulse has begun, so the next one can be set.
#[doc(hidden)]
#[inline(always)]
pub fn pulse_begins(masked: &Masked) {
    period::begin_if_due(masked);
    set_pulse(ENCODER.get(masked).next(|| next_byte(masked)));
}

/// The interrupt INT7 if the line is high and was expected to rise: it needs few registers, and saves no
/// more. If the line has fallen again, that interrupts once more.
#[doc(hidden)]
#[inline(always)]
pub fn line_rises(masked: &Masked) {
    rises(masked);
    period::begin_if_due(masked); // as at the end of `line_changes`
}

/// The interrupt INT7 in other cases: the line has fallen, or changed more than once.
#[doc(hidden)]
#[inline(always)]
pub fn line_changes(masked: &Masked) {
    period::begin_if_due(masked);
    let is_behind = if registers::expects_rising() { rises(masked) } else { falls(masked) };
    if is_behind {
        catch_up(masked);
    }
    period::begin_if_due(masked); // one that has become due meanwhile need not wait for the next vector
}

/// Handles a line that has changed more than once since the last check. That is rare, so it is a call.
#[cold]
#[inline(never)]
fn catch_up(masked: &Masked) {
    while if registers::expects_rising() { rises(masked) } else { falls(masked) } {}
}

/// Handles a rise, if there was one. Returns whether the line has fallen again already.
#[inline(always)]
fn rises(masked: &Masked) -> bool {
    let has_changed = registers::is_high(); // before the flag is read, which an edge sets first
    let decoder = DECODER.get(masked);
    let time = match registers::captured() {
        Some(time) => time,
        None if has_changed => decoder.untimed_rise(),
        None => return false,
    };
    registers::expect(false);
    decoder.rise(time);
    !registers::is_high()
}

/// Handles a fall, if there was one. Returns whether the line has risen again already.
#[inline(always)]
fn falls(masked: &Masked) -> bool {
    let has_changed = !registers::is_high();
    let decoder = DECODER.get(masked);
    let time = match registers::captured() {
        Some(time) => time,
        None if has_changed => decoder.untimed_fall(),
        None => return false,
    };
    registers::expect(true);
    if let Some(event) = decoder.fall(time) {
        registers::set_match_b(decoder.ends_at());
        take(masked, event.ended);
    }
    registers::is_high()
}

/// The interrupt "Timer/Counter3 Compare Match B": a character has ended and no other has begun, or the last
/// stop bit of a transmission is on the wire.
#[doc(hidden)]
#[inline(always)]
pub fn character_ends(masked: &Masked) {
    registers::ignore_match_b();
    if IS_SENDING.get(masked) {
        IS_SENDING.set(masked, false);
        registers::listen();
        return deferred::raise(masked, source::SOFT_UART_SENT);
    }
    take(masked, DECODER.get(masked).ended(!registers::expects_rising()));
    period::begin_if_due(masked); // as at the end of `line_changes`
}

/// Served by the software interrupt when the last stop bit of a transmission is on the wire.
#[doc(hidden)]
#[inline(always)]
pub fn sent(serving: &mut Serving) {
    serving.window();
    PORT.finish(serving.interrupt);
}

/// Stores a received character.
#[inline(always)]
fn take(masked: &Masked, ended: Option<Character>) {
    match ended {
        Some(Character::Byte(byte)) => {
            if PORT.put(masked, byte) {
                deferred::raise(masked, source::SOFT_UART);
            }
        }
        Some(Character::Malformed) => PORT.lose(masked),
        None => {}
    }
}
