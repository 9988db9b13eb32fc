//! The registers of the serial line in software (ATmega128 datasheet, "16-bit Timer/Counter", "External
//! Interrupts"). They must be used with interrupts masked: the accesses to the timer's 16-bit registers share
//! a byte, and other drivers change bits in the same registers.

use avr_device::atmega128a::{EXINT, PORTE, TC3};

/// TCCR3B: the timer counts the MCU's clock.
const CLOCK: u8 = 1 << 0; // CS30
/// TCCR3B, the bit: capture at a rising edge.
const RISING: u8 = 6; // ICES3
/// TCCR3B while the line is received, for the edge that is expected next.
const EXPECT_FALLING: u8 = CLOCK;
const EXPECT_RISING: u8 = CLOCK | 1 << RISING;
/// TCCR3A and TCCR3B: count up to OCR3A; at 0 the compare registers take over the values that were written to
/// them before.
const PULSES_A: u8 = 0b11; // WGM31, WGM30
const PULSES_B: u8 = 0b11 << 3; // WGM33, WGM32
/// TCCR3A: pin OC3C is set at a match, and cleared at 0 while counting up to OCR3A.
const SETS: u8 = 0b11 << 2; // COM3C1, COM3C0

/// ETIMSK and ETIFR: a match of unit B.
const MATCH_B: u8 = 1 << 3;
/// ETIFR, the bit: an edge was captured.
const CAPTURED: u8 = 5; // ICF3

/// EIMSK and EIFR: INT5, the falling edges that are sent.
const SENT: u8 = 1 << 5;
/// EIMSK and EIFR: INT7, the edges that are received.
const RECEIVED: u8 = 1 << 7;

#[inline(always)]
fn timer() -> TC3 {
    // SAFETY: only one serial line in software exists, and its parts call this with interrupts masked.
    unsafe { TC3::steal() }
}

#[inline(always)]
fn external() -> EXINT {
    // SAFETY: drivers of other pins share these registers, and all change them with interrupts masked, in one
    // step.
    unsafe { EXINT::steal() }
}

/// Makes PE5 a high output, and PE7 an input: pulled up, so that a dock without a receiver is idle.
pub fn start() {
    // SAFETY: pins share these registers, and all change them with interrupts masked, as they are when this
    // is called.
    let port = unsafe { PORTE::steal() };
    port.porte().modify(|_, w| w.pe7().set_bit().pe5().set_bit());
    // INT5: falling edges; INT7: all edges. Set while both are disabled, as the change may set their flags,
    // which are cleared below.
    external().eicrb().modify(|_, w| w.isc5().val_0x02().isc7().val_0x01());
    listen();
    timer().tccr3c().write(|w| w.foc3c().set_bit()); // OC3C's own level, which is low after reset
    port.ddre().modify(|_, w| w.pe5().set_bit());
    external().eifr().write(|w| w.intf().set(SENT));
    external().eimsk().modify(|r, w| w.int().set(r.int().bits() | SENT));
}

/// Lets the timer count through all 16 bits, and watches for edges from now on. The line that is sent on
/// stays high.
#[inline(always)]
pub fn listen() {
    // SAFETY: the timer touches no memory, whatever its registers hold. Units A and B leave their pins to the
    // port.
    timer().tccr3a().write(|w| unsafe { w.bits(SETS) });
    expect(!is_high());
    external().eifr().write(|w| w.intf().set(RECEIVED));
    external().eimsk().modify(|r, w| w.int().set(r.int().bits() | RECEIVED));
}

/// Makes the line go low `lead` clocks from now, at least 2; the pulse that is set next begins then. Edges
/// received are ignored from now on.
pub fn begin_pulses(lead: u16) {
    external().eimsk().modify(|r, w| w.int().set(r.int().bits() & !RECEIVED));
    // In this mode they take effect at once, for a first round with the line high.
    timer().ocr3a().write(|w| w.set(lead - 1));
    timer().ocr3b().write(|w| w.set(u16::MAX));
    timer().ocr3c().write(|w| w.set(0));
    timer().tcnt3().write(|w| w.set(0));
    // SAFETY: the timer touches no memory, whatever its registers hold. This mode gives the pin of unit C to
    // the timer.
    timer().tccr3a().write(|w| unsafe { w.bits(SETS | PULSES_A) });
    // SAFETY: the timer touches no memory, whatever its registers hold.
    timer().tccr3b().write(|w| unsafe { w.bits(CLOCK | PULSES_B) });
    // A value written before the change of mode need not be in the buffer that is taken over with the first
    // pulse, since "the CPU will access the OCR3x directly". The buffers of units A and C are set with that
    // pulse.
    timer().ocr3b().write(|w| w.set(u16::MAX));
    ignore_match_b();
}

/// Sets the pulse that follows the present one: for `low` clocks the line is low, and after `length` clocks
/// the next pulse begins.
#[inline(always)]
pub fn set_pulse(low: u16, length: u16) {
    timer().ocr3c().write(|w| w.set(low - 1));
    timer().ocr3a().write(|w| w.set(length - 1));
}

/// Sets the last pulse: `length` clocks after its beginning unit B matches, and the line stays high.
#[inline(always)]
pub fn set_last_pulse(low: u16, length: u16) {
    timer().ocr3c().write(|w| w.set(low - 1));
    timer().ocr3a().write(|w| w.set(u16::MAX));
    timer().ocr3b().write(|w| w.set(length - 1));
    watch_match_b();
}

/// The time of the expected edge; `None` if it has not come.
#[inline(always)]
pub fn captured() -> Option<u16> {
    let is_captured = timer().etifr().read().bits() & 1 << CAPTURED != 0;
    is_captured.then(|| timer().icr3().read().bits())
}

/// Expects a rising edge next, or a falling one.
#[inline(always)]
pub fn expect(is_rising: bool) {
    // SAFETY: the timer touches no memory, whatever its registers hold.
    timer().tccr3b().write(|w| unsafe { w.bits(if is_rising { EXPECT_RISING } else { EXPECT_FALLING }) });
    // After the change, as that may set the flag (datasheet, "Using the Input Capture Unit"). Ones clear
    // flags.
    // SAFETY: the timer touches no memory, whatever its registers hold.
    timer().etifr().write(|w| unsafe { w.bits(1 << CAPTURED) });
}

/// Whether a rising edge is expected.
#[inline(always)]
pub fn expects_rising() -> bool {
    timer().tccr3b().read().bits() & 1 << RISING != 0
}

/// The level of the receiving pin, PE7.
#[inline(always)]
pub fn is_high() -> bool {
    // SAFETY: reading a pin changes nothing.
    unsafe { PORTE::steal() }.pine().read().pe7().bit_is_set()
}

/// Makes unit B interrupt at `time`, and not for an earlier match.
#[inline(always)]
pub fn set_match_b(time: u16) {
    timer().ocr3b().write(|w| w.set(time));
    forget_match_b();
    watch_match_b();
}

/// Clears a match of unit B whose interrupt has not occurred yet.
#[inline(always)]
fn forget_match_b() {
    // SAFETY: the timer touches no memory, whatever its registers hold. Ones clear flags.
    timer().etifr().write(|w| unsafe { w.bits(MATCH_B) });
}

/// Makes unit B interrupt at its match.
#[inline(always)]
fn watch_match_b() {
    // SAFETY: the timer touches no memory, whatever its registers hold.
    timer().etimsk().modify(|r, w| unsafe { w.bits(r.bits() | MATCH_B) });
}

/// Keeps unit B from interrupting.
#[inline(always)]
pub fn ignore_match_b() {
    // SAFETY: the timer touches no memory, whatever its registers hold.
    timer().etimsk().modify(|r, w| unsafe { w.bits(r.bits() & !MATCH_B) });
    forget_match_b();
}
