//! A timer whose interrupt, "Timer/Counter2 Compare Match" (`__vector_9`), the example handles.

use avr_device::atmega128a::TC2;

/// Starts the timer: from now on it interrupts every 4 ms.
pub fn start() {
    // SAFETY: the board has no driver for this timer. Others share TIMSK, and start before the kernel does,
    // as this does.
    let timer = unsafe { TC2::steal() };
    timer.ocr2().write(|w| w.set(249)); // 250 times 256 clocks of 16 MHz
    timer.timsk().modify(|_, w| w.ocie2().set_bit());
    // WGM21 alone: clear timer on compare match.
    timer.tccr2().write(|w| w.wgm21().set_bit().cs0().prescale_256());
}
