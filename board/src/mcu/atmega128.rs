//! The ATmega128.

#[cfg(not(feature = "tickless"))]
use avr_device::atmega128a::TC0;
use avr_device::atmega128a::{AC, CPU, EXINT, TC2};
#[cfg(not(feature = "tickless"))]
use avr_device::interrupt;

/// OCDR, through which a program sends values to the on-chip debugger (datasheet, "On-chip Debug Related
/// Register in I/O Memory"). Without a debugger it does nothing.
pub(crate) const MARK: u8 = 0x22;

/// EIMSK: INT4.
const INT4: u8 = 1 << 4;

pub(crate) fn set_up() {
    // SAFETY: the MCU is set up once, before its devices are handed out.
    let (cpu, comparator) = unsafe { (CPU::steal(), AC::steal()) };
    cpu.mcucr().write(|w| w.se().set_bit()); // the mode bits stay 0: idle
    comparator.acsr().write(|w| w.acd().set_bit());
}

/// Interrupts each time that Timer0 has counted 64 clocks `top` + 1 times.
#[cfg(not(feature = "tickless"))]
pub(crate) fn start_tick(top: u8) {
    // SAFETY: the tick alone uses Timer0, and starts it once. Other timers share TIMSK, and their interrupts
    // change their bits there: they are masked during this change.
    let timer = unsafe { TC0::steal() };
    timer.ocr0().write(|w| w.set(top));
    interrupt::free(|_| timer.timsk().modify(|_, w| w.ocie0().set_bit()));
    // WGM01 alone: clear timer on compare match.
    timer.tccr0().write(|w| w.wgm01().set_bit().cs0().prescale_64());
}

/// Lets Timer2 reach its compare value every second clock.
pub(crate) fn start_timer2() {
    // SAFETY: single steps alone use Timer2, and start it once.
    let timer = unsafe { TC2::steal() };
    timer.ocr2().write(|w| w.set(1));
    // WGM21 alone: clear timer on compare match. CS20: no prescaler.
    timer.tccr2().write(|w| w.wgm21().set_bit().cs2().val_0x01());
}

/// Enables or disables the interrupt of Timer2. To be called with interrupts masked.
pub(crate) fn enable_timer2(is_enabled: bool) {
    // SAFETY: the bits of other timers stay as they are.
    let timer = unsafe { TC2::steal() };
    timer.timsk().modify(|_, w| w.ocie2().bit(is_enabled));
}

/// Disables all external interrupts. Returns what their enable bits were.
pub(crate) fn hold_external() -> u8 {
    // SAFETY: called with interrupts masked; what is latched meanwhile occurs later.
    let enable = unsafe { EXINT::steal() };
    let held = enable.eimsk().read().int().bits();
    enable.eimsk().write(|w| w.int().set(0));
    held
}

/// Undoes [`hold_external`]. What was enabled meanwhile stays so.
pub(crate) fn release_external(held: u8) {
    // SAFETY: called with interrupts masked.
    let enable = unsafe { EXINT::steal() };
    enable.eimsk().modify(|r, w| w.int().set(r.int().bits() | held));
}

/// Interrupts at each rising edge of INT4, at pin PE4. To be called with interrupts masked.
pub(crate) fn start_external() {
    // SAFETY: one driver uses INT4, and starts it once; the bits of other interrupts stay as they are.
    let external = unsafe { EXINT::steal() };
    external.eicrb().modify(|_, w| w.isc4().val_0x03());
    external.eifr().write(|w| w.intf().set(INT4)); // an edge from before, or from the change of sense
    external.eimsk().modify(|r, w| w.int().set(r.int().bits() | INT4));
}

/// The tick's vector: TIMER1_COMPA.
#[cfg(feature = "tickless")]
#[macro_export]
macro_rules! tick_interrupt {
    () => {
        $crate::kernel::tickless_interrupt!(__vector_12, $crate::tick::Timer1);
    };
}

/// The tick's vector: TIMER0_COMP.
#[cfg(not(feature = "tickless"))]
#[macro_export]
macro_rules! tick_interrupt {
    () => {
        $crate::kernel::tick_interrupt!(__vector_15);
    };
}

/// Defines what the external interrupt does, INT4.
#[macro_export]
macro_rules! external_interrupt {
    ($interrupt:ident => $body:expr) => {
        $crate::kernel::interrupt! {
            fn __vector_5($interrupt) { $body }
        }
    };
}

/// The vector of single steps: TIMER2_COMP.
#[macro_export]
macro_rules! trap_interrupt {
    () => {
        $crate::kernel::trap_interrupt! {
            fn __vector_9(interrupt) { $crate::trap::disarm(interrupt) }
        }
    };
}
