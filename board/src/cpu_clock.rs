//! The clock of tasks' CPU times, for the kernel's feature `cpu-time`: Timer3, which counts the MCU's clocks.

use avr_device::atmega128a::TC3;

use crate::interrupts::Serves;

/// ETIMSK: OCIE3A and TOIE3, a match of unit A and the overflow.
const TURNS: u8 = 1 << 4 | 1 << 2;

/// Half a turn.
const HALF: u16 = 0x8000;

/// The clock of tasks' CPU times. It uses Timer3, as does the UART in software: a program can start only one
/// of them.
pub struct CpuClock(());

impl CpuClock {
    pub(crate) const fn new() -> Self {
        CpuClock(())
    }

    /// Starts the clock. It must be called before the kernel runs; the clock counts from then on.
    pub fn start(self, _: impl Serves<CpuClock>, _: &mut kernel::Boot) {
        // SAFETY: nothing else uses Timer3, and interrupts are masked. No value of its registers touches
        // memory.
        unsafe {
            let timer = TC3::steal();
            timer.ocr3a().write(|w| w.set(HALF));
            timer.etimsk().modify(|r, w| w.bits(r.bits() | TURNS));
            timer.tccr3b().write(|w| w.bits(1 << 0)); // CS30: no prescaler
        }
    }
}
