//! The period of the joints' control, and the drives that take effect when one begins.
//!
//! A drive takes effect at the beginning of the next period, in that period's interrupt. So it is in time,
//! however late the task was that computed it. The vectors that have priority over that interrupt check
//! whether it is due, and begin the period in its stead. So they never add to the other delays of that
//! interrupt.

use avr_device::atmega128a::{PORTB, PORTC, TC1, TC2};
use kernel::{Context, Interrupt, Masked, MaskedCell, Task};

use crate::gpio::{Port, PortB};

/// The state of the present period, and the drives that take effect with the next one.
struct Period {
    state: MaskedCell<u8>,
    /// The directions, bits of PORTC: of the joint in this half, and of the roll joint. Their task alone sets
    /// them.
    directions: MaskedCell<u8>,
    /// Their speeds.
    speeds: [MaskedCell<u16>; 2],
}

static PERIOD: Period = Period {
    state: MaskedCell::new(IS_OFF),
    directions: MaskedCell::new(DIRECTIONS),
    speeds: [const { MaskedCell::new(0) }; 2],
};

/// The joints are not controlled.
const IS_OFF: u8 = 0;
/// The next period has not begun.
const IS_AWAITED: u8 = 1;
/// The period has begun, and its interrupt has not occurred yet.
const HAS_BEGUN: u8 = 2;

/// PORTC: PC0 and PC1.
const DIRECTIONS: u8 = 0b11;

/// Has the joint at this place turn with `drive` from the next period on, -400 to 400; its task alone calls
/// this.
#[inline(always)]
pub(crate) fn drive(task: &mut Task, joint: usize, drive: i16) {
    let Some(speed) = PERIOD.speeds.get(joint) else { return };
    let bit = if joint == 0 { 0b01 } else { 0b10 }; // the AVR would shift it in a loop
    let others = task.mask(|masked| PERIOD.directions.get(masked)) & !bit;
    let directions = if drive >= 0 { others | bit } else { others };
    let duty = drive.unsigned_abs();
    task.mask(|masked| {
        speed.set(masked, duty);
        PERIOD.directions.set(masked, directions);
    });
}

/// Begins or ends the control of the joints. When it ends, the last drives are put into effect.
#[inline(always)]
pub(crate) fn control(masked: &Masked, is_on: bool) {
    PERIOD.state.set(masked, if is_on { IS_AWAITED } else { IS_OFF });
    if !is_on {
        put_into_effect(masked);
        PortB::set_output(1 << 4, false); // the probe
    }
}

/// The period's interrupt has occurred: the next period is awaited.
#[inline(always)]
pub(crate) fn await_next(masked: &Masked) {
    if PERIOD.state.get(masked) == HAS_BEGUN {
        PERIOD.state.set(masked, IS_AWAITED);
    }
}

/// Begins the period if its interrupt waits for the vector that calls this.
#[inline(always)]
pub(crate) fn begin_if_due(masked: &Masked) {
    if is_due() {
        begin_period(masked);
    }
}

/// As [`begin_if_due`], for handlers of the kernel, which may call functions.
#[inline(always)]
pub(crate) fn begin_if_due_by_call(masked: &Masked) {
    #[inline(never)]
    fn begin(masked: &Masked) {
        begin_period(masked);
    }
    if is_due() {
        begin(masked);
    }
}

/// Called last by handlers of the kernel: a period that has become due meanwhile need not wait until the
/// interrupt is left, nor for a critical section behind it.
#[doc(hidden)]
#[inline(always)]
#[expect(clippy::redundant_closure, reason = "without, the compiler makes a function of it")]
pub fn begin_before_leaving(interrupt: &mut Interrupt) {
    interrupt.mask(|masked| begin_if_due_by_call(masked));
}

#[inline(always)]
fn is_due() -> bool {
    // SAFETY: reading TIFR changes nothing.
    unsafe { TC2::steal() }.tifr().read().ocf2().bit_is_set()
}

/// Begins the period, if it has not begun: raises the probe, and puts the drives into effect.
#[inline(always)]
pub(crate) fn begin_period(masked: &Masked) {
    if PERIOD.state.get(masked) != IS_AWAITED {
        return;
    }
    PERIOD.state.set(masked, HAS_BEGUN);
    // SAFETY: PORTB changes with interrupts masked only.
    unsafe { PORTB::steal() }.portb().modify(|_, w| w.pb4().set_bit()); // the probe
    put_into_effect(masked);
}

/// Puts the drives into effect.
#[inline(always)]
fn put_into_effect(masked: &Masked) {
    // SAFETY: PORTC changes with interrupts masked only, the compare units' registers here only.
    let (directions, speeds) = unsafe { (PORTC::steal(), TC1::steal()) };
    let [joint, roll] = &PERIOD.speeds;
    // SAFETY: a port touches no memory, whatever its register holds.
    directions
        .portc()
        .modify(|r, w| unsafe { w.bits(r.bits() & !DIRECTIONS | PERIOD.directions.get(masked)) });
    speeds.ocr1a().write(|w| w.set(joint.get(masked)));
    speeds.ocr1b().write(|w| w.set(roll.get(masked)));
}
