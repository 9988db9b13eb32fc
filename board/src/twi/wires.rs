//! SCL and SDA as pins, while the interface is off.

use avr_device::atmega128a::PORTD;
use embedded_hal::delay::DelayNs;
use kernel::{Context, Task};

use crate::delay::Delay;

/// Half a bit at 100 kHz, which every device on a bus can follow, in us.
const HALF_BIT: u32 = 5;

/// A wire of the bus. It is low while its pin of PORTD is an output; otherwise a resistor pulls it up.
#[derive(Clone, Copy)]
pub enum Wire {
    /// SCL = PD0.
    Clock,
    /// SDA = PD1.
    Data,
}

/// Pulls a wire low, or releases it; then waits for half a bit.
pub fn pull(task: &mut Task, wire: Wire, is_low: bool) {
    // SAFETY: pins share these registers, so they change with interrupts masked only.
    let port = unsafe { PORTD::steal() };
    task.mask(|_| {
        port.ddrd().modify(|_, w| match wire {
            Wire::Clock => w.pd0().bit(is_low),
            Wire::Data => w.pd1().bit(is_low),
        });
    });
    Delay::new(task).delay_us(HALF_BIT);
}

/// The level of SDA.
pub fn data_is_high() -> bool {
    // SAFETY: reading a pin changes nothing.
    unsafe { PORTD::steal() }.pind().read().pd1().bit_is_set()
}
