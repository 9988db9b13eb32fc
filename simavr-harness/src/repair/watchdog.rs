//! The watchdog of the ATmega128 (chapter "Watchdog Timer"). It has no interrupt, so simavr leaves its IRQs
//! without a pool; simavr's own reset then dereferences that pool, and crashes. simavr also keeps the
//! watchdog running after a reset, and as long as WDRF is set, as newer parts do. Here it is off after every
//! reset, and the timed sequence switches it off whatever WDRF is. A single write switches a watchdog on that
//! is off, for any time. Its times are the typical ones at 5 V; simavr has those of later parts.
//!
//! On every part the instruction WDR registers a cycle timer outside any register write. That, too, must keep
//! the deadline of a run.

use std::ffi::{c_int, c_void};
use std::sync::OnceLock;

use simavr_ffi as ffi;
use simulation::CLOCK_HZ;

use crate::cpu::{Cpu, RegisterBits};
use crate::device::WrappedWrites;

type Request = unsafe extern "C" fn(*mut ffi::avr_io_t, u32, *mut c_void) -> c_int;

/// simavr's handler of requests to a watchdog, the same for all instances.
static REQUEST: OnceLock<Request> = OnceLock::new();

/// Bits of WDTCR of the ATmega128: change enable, watchdog enable, prescaler.
const WDCE: u8 = 0x10;
const WDE: u8 = 0x08;
const WDP: u8 = 0x07;

/// The shortest time-out in microseconds (table "Watchdog Timer Prescale Select", at 5 V). Each longer one is
/// twice the one before.
const SHORTEST_MICROS: u64 = 14_050;

/// simavr's request to a watchdog to restart, as for WDR.
const START_OVER: u32 = u32::from_be_bytes(*b"wdtr");

pub(crate) fn install(cpu: Cpu, wrapped: &mut WrappedWrites) {
    cpu.peripherals(|kind, peripheral| {
        if kind != "watchdog" {
            return;
        }
        // SAFETY: simavr's list holds live peripherals, and one of this kind is the first field of
        // an `avr_watchdog_t`; simavr does without either handler.
        unsafe {
            let watchdog = peripheral.cast::<ffi::avr_watchdog_t>();
            let has_interrupt = (*watchdog).watchdog.vector != 0;
            if !has_interrupt {
                wrapped.wrap(cpu, RegisterBits::from((*watchdog).wde).address, follow);
                (*peripheral).reset = None;
            }
            if let Some(request) = (*peripheral).ioctl {
                REQUEST.get_or_init(|| request);
                (*peripheral).ioctl = Some(keep_deadline_after_request);
            }
        }
    });
}

/// Corrects WDTCR and the time-out after simavr has handled a write to WDTCR.
fn follow(cpu: Cpu, wdtcr: u16, before: u8, written: u8) {
    let was_on = before & WDE != 0;
    if !was_on {
        cpu.set_bits(wdtcr, WDE | WDP, false);
        cpu.set_bits(wdtcr, written & (WDE | WDP), true);
    } else if before & WDCE != 0 && written & WDE == 0 {
        // simavr's timer may run on; it then has no effect.
        cpu.set_bits(wdtcr, WDE, false);
    }
    let now = cpu.data(wdtcr);
    let starts = now & WDE != 0 && (!was_on || (before ^ now) & WDP != 0);
    cpu.peripherals(|kind, peripheral| {
        let Some(handler) = REQUEST.get().filter(|_| kind == "watchdog") else { return };
        // SAFETY: the list holds live peripherals, and one of this kind is the first field of an
        // `avr_watchdog_t`, as in `install`; the handler is simavr's own.
        unsafe {
            let micros = SHORTEST_MICROS << (now & WDP);
            (*peripheral.cast::<ffi::avr_watchdog_t>()).cycle_count =
                micros * u64::from(CLOCK_HZ) / 1_000_000;
            if starts {
                handler(peripheral, START_OVER, std::ptr::null_mut());
            }
        }
    });
}

unsafe extern "C" fn keep_deadline_after_request(
    io: *mut ffi::avr_io_t,
    request: u32,
    parameter: *mut c_void,
) -> c_int {
    let Some(handler) = REQUEST.get() else { return -1 };
    // SAFETY: simavr passes a live watchdog of a live instance; the handler is simavr's own.
    unsafe {
        let answer = handler(io, request, parameter);
        Cpu::from_raw((*io).avr).keep_deadline();
        answer
    }
}
