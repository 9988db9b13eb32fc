//! The analog-to-digital converter: one conversion at a time, without waiting in a loop.
//!
//! embedded-hal 1.0 has no trait for converters, so [`Converter::convert`] is a method of its own.

use avr_device::atmega128a::ADC;
use kernel::{Interrupt, Semaphore, Task};

use crate::interrupts::Serves;

/// An analog input of port F. ADC4 to ADC7 belong to JTAG as long as the fuse JTAGEN is programmed.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Channel {
    Adc0 = 0,
    Adc1 = 1,
    Adc2 = 2,
    Adc3 = 3,
    Adc4 = 4,
    Adc5 = 5,
    Adc6 = 6,
    Adc7 = 7,
}

/// ADMUX: full scale is AVCC.
const REFERENCE: u8 = 1 << 6; // REFS0

/// ADCSRA: the converter and its interrupt are on. The clock of 125 kHz lies within the 50 to 200 kHz that
/// 10 bits take (ATmega128 datasheet, "Prescaling and Conversion Timing").
const ENABLED: u8 = 1 << 7 | 1 << 3 | 0b111; // ADEN, ADIE, clock / 128
/// ADCSRA: begin a conversion.
const START: u8 = 1 << 6; // ADSC

static IS_CONVERTED: Semaphore = Semaphore::new(0);

fn registers() -> ADC {
    // SAFETY: there is one `Converter`; the interrupt uses no register.
    unsafe { ADC::steal() }
}

/// The analog-to-digital converter.
pub struct Adc(());

impl Adc {
    pub(crate) const fn new() -> Self {
        Adc(())
    }

    /// Switches the converter on. The first conversion takes 200 us.
    pub fn start(self, _: impl Serves<Adc>) -> Converter {
        // SAFETY: the converter touches no memory, whatever its registers hold.
        registers().adcsra().write(|w| unsafe { w.bits(ENABLED) });
        Converter(())
    }
}

/// The running converter.
pub struct Converter(());

impl Converter {
    /// The voltage at `channel`, in 1/1024 of AVCC: 0 to 1023. Blocks for 104 us.
    pub fn convert(&mut self, task: &mut Task, channel: Channel) -> u16 {
        // SAFETY: as above.
        registers().admux().write(|w| unsafe { w.bits(REFERENCE | channel as u8) });
        // SAFETY: as above.
        registers().adcsra().write(|w| unsafe { w.bits(ENABLED | START) });
        IS_CONVERTED.wait(task);
        registers().adc().read().bits()
    }
}

/// The interrupt "ADC Conversion Complete".
#[doc(hidden)]
#[inline(always)]
pub fn conversion_complete(interrupt: &mut Interrupt) {
    IS_CONVERTED.post(interrupt);
}
