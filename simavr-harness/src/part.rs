//! The register maps of the parts that the harness knows: data addresses and vector numbers,
//! from the datasheets' register summaries.

use thiserror::Error;

mod timers;

pub(crate) use timers::{Compare, Control, TimerRegisters};

/// One microcontroller.
#[derive(Debug)]
pub struct Part {
    /// The part's name in simavr and for avr-gcc's `-mmcu`.
    pub name: &'static str,
    /// The last address of SRAM, where the first stack begins.
    pub ram_end: u16,
    /// Bytes of a return address: 3 on a part with more than 128 KB of flash.
    pub return_address: u16,
    /// A register without any effect, to which a program writes markers. The on-chip debug register OCDR, or
    /// the general purpose register GPIOR0 on parts that have one.
    pub(crate) marker: u16,
    /// The read-only PINx registers. On later parts a write to PINx toggles PORTx.
    pub(crate) read_only_pins: &'static [u16],
    /// PCIFR, on the later parts.
    pub(crate) pin_change_flags: Option<u16>,
    /// The other registers of flags that SBI and CBI reach. Not every later part has all of them.
    pub(crate) other_flags: &'static [u16],
    /// In the order of their numbers.
    pub(crate) usarts: &'static [UsartRegisters],
    pub(crate) twi: TwiRegisters,
    pub(crate) eeprom: EepromRegisters,
    /// `None`: simavr's own stays.
    pub(crate) adc: Option<AdcRegisters>,
    /// `None`: simavr's own stays.
    pub(crate) spm: Option<SpmRegisters>,
    /// It has MCUCR and XDIV, as the ATmega128 does.
    pub(crate) has_mcucr: bool,
    /// Its external interrupts and its SPI are those of the ATmega128. Otherwise simavr's own stay.
    pub(crate) has_external_and_spi: bool,
    /// Empty: simavr's own stay.
    pub(crate) timers: &'static [TimerRegisters],
}

/// A pin: its port's letter and its bit, 0 to 7.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Pin {
    pub port: char,
    pub bit: u8,
}

/// A port: its letter, and the data address of PINx, which DDRx and PORTx follow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Port {
    pub name: char,
    pub pins: u16,
}

impl Port {
    /// The data address of DDRx.
    pub fn direction(self) -> u16 {
        self.pins + 1
    }

    /// The data address of PORTx.
    pub fn register(self) -> u16 {
        self.pins + 2
    }
}

#[derive(Debug)]
pub(crate) struct UsartRegisters {
    pub udr: u16,
    pub ucsra: u16,
    pub ucsrb: u16,
    pub ucsrc: u16,
    pub ubrrl: u16,
    pub ubrrh: u16,
    pub receive_complete: u8,
    pub data_register_empty: u8,
    pub transmit_complete: u8,
}

#[derive(Debug)]
pub(crate) struct TwiRegisters {
    pub twbr: u16,
    pub twsr: u16,
    pub twar: u16,
    pub twdr: u16,
    pub twcr: u16,
    pub vector: u8,
}

#[derive(Debug)]
pub(crate) struct EepromRegisters {
    pub eecr: u16,
    pub eedr: u16,
    pub eearl: u16,
    pub eearh: u16,
    pub ready: u8,
    /// In bytes, a power of two.
    pub size: u16,
    /// How long a write takes (table "EEPROM Programming Time"), in microseconds.
    pub write_micros: u64,
    /// How long it takes to erase or to write alone; `None` where a write always does both.
    pub half_micros: Option<u64>,
}

#[derive(Debug)]
pub(crate) struct AdcRegisters {
    pub adcl: u16,
    pub adch: u16,
    pub adcsra: u16,
    pub admux: u16,
    pub complete: u8,
}

/// The registers of self-programming that its interrupt needs.
#[derive(Debug)]
pub(crate) struct SpmRegisters {
    pub spmcsr: u16,
    pub ready: u8,
}

/// The harness has no register map of a part.
#[derive(Debug, Error)]
#[error("the harness has no register map of a part \"{name}\"; it knows: {known}")]
pub struct UnknownPart {
    name: String,
    known: String,
}

impl Part {
    /// The ATmega128, with fuse M103C unprogrammed.
    pub const ATMEGA128: &'static Part = &Part {
        name: "atmega128",
        ram_end: 0x10ff,
        return_address: 2,
        marker: 0x42,
        read_only_pins: &[0x39, 0x36, 0x33, 0x30, 0x21, 0x20, 0x63],
        pin_change_flags: None,
        other_flags: &[],
        usarts: &[
            UsartRegisters {
                udr: 0x2c,
                ucsra: 0x2b,
                ucsrb: 0x2a,
                ucsrc: 0x95,
                ubrrl: 0x29,
                ubrrh: 0x90,
                receive_complete: 18,
                data_register_empty: 19,
                transmit_complete: 20,
            },
            UsartRegisters {
                udr: 0x9c,
                ucsra: 0x9b,
                ucsrb: 0x9a,
                ucsrc: 0x9d,
                ubrrl: 0x99,
                ubrrh: 0x98,
                receive_complete: 30,
                data_register_empty: 31,
                transmit_complete: 32,
            },
        ],
        twi: TwiRegisters { twbr: 0x70, twsr: 0x71, twar: 0x72, twdr: 0x73, twcr: 0x74, vector: 33 },
        eeprom: EepromRegisters {
            eecr: 0x3c,
            eedr: 0x3d,
            eearl: 0x3e,
            eearh: 0x3f,
            ready: 22,
            size: 4096,
            write_micros: 8448,
            half_micros: None,
        },
        adc: Some(AdcRegisters { adcl: 0x24, adch: 0x25, adcsra: 0x26, admux: 0x27, complete: 21 }),
        spm: Some(SpmRegisters { spmcsr: 0x68, ready: 34 }),
        has_mcucr: true,
        has_external_and_spi: true,
        timers: timers::ATMEGA128,
    };

    pub const ATMEGA328P: &'static Part = &Part {
        name: "atmega328p",
        ram_end: 0x08ff,
        return_address: 2,
        marker: GPIOR0,
        read_only_pins: &[],
        pin_change_flags: Some(PCIFR),
        other_flags: OTHER_FLAGS,
        usarts: &[later_usart(0xc0, 18)],
        twi: later_twi(24),
        eeprom: later_eeprom(22, 1024),
        adc: None,
        spm: None,
        has_mcucr: false,
        has_external_and_spi: false,
        timers: &[],
    };

    pub const ATMEGA1284P: &'static Part = &Part {
        name: "atmega1284p",
        ram_end: 0x40ff,
        return_address: 2,
        marker: GPIOR0,
        read_only_pins: &[],
        pin_change_flags: Some(PCIFR),
        other_flags: OTHER_FLAGS,
        usarts: &[later_usart(0xc0, 20), later_usart(0xc8, 28)],
        twi: later_twi(26),
        eeprom: later_eeprom(25, 4096),
        adc: None,
        spm: None,
        has_mcucr: false,
        has_external_and_spi: false,
        timers: &[],
    };

    pub const ATMEGA2560: &'static Part = &Part {
        name: "atmega2560",
        ram_end: 0x21ff,
        return_address: 3,
        marker: GPIOR0,
        read_only_pins: &[],
        pin_change_flags: Some(PCIFR),
        other_flags: OTHER_FLAGS,
        usarts: &[
            later_usart(0xc0, 25),
            later_usart(0xc8, 36),
            later_usart(0xd0, 51),
            later_usart(0x130, 54),
        ],
        twi: later_twi(39),
        eeprom: later_eeprom(30, 4096),
        adc: None,
        spm: None,
        has_mcucr: false,
        has_external_and_spi: false,
        timers: &[],
    };

    /// All parts that the harness knows.
    pub const ALL: [&'static Part; 4] =
        [Self::ATMEGA128, Self::ATMEGA328P, Self::ATMEGA1284P, Self::ATMEGA2560];

    /// The part of this name.
    ///
    /// # Errors
    /// The harness has no register map of it.
    pub fn named(name: &str) -> Result<&'static Part, UnknownPart> {
        Self::ALL.into_iter().find(|part| part.name == name).ok_or_else(|| UnknownPart {
            name: name.to_owned(),
            known: Self::ALL.map(|part| part.name).join(", "),
        })
    }

    /// Cycles from the end of an instruction to the first one at the vector of an interrupt (chapter "Reset
    /// and Interrupt Handling"): 2, and one for each byte of the program counter that is pushed.
    pub(crate) fn response_cycles(&self) -> u64 {
        2 + u64::from(self.return_address)
    }

    /// Further cycles when the interrupt ends a sleep: as many again.
    pub(crate) fn wake_up_cycles(&self) -> u64 {
        self.response_cycles()
    }
}

/// PCIFR of the parts that came after the ATmega128.
const PCIFR: u16 = 0x3b;

/// TIFR0 to TIFR5 and EIFR of the parts that came after the ATmega128.
const OTHER_FLAGS: &[u16] = &[0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x3c];

/// GPIOR0 of the parts that came after the ATmega128.
const GPIOR0: u16 = 0x3e;

/// A USART of the later parts. All are laid out alike, with consecutive vectors.
const fn later_usart(first: u16, receive_complete: u8) -> UsartRegisters {
    UsartRegisters {
        ucsra: first,
        ucsrb: first + 1,
        ucsrc: first + 2,
        ubrrl: first + 4,
        ubrrh: first + 5,
        udr: first + 6,
        receive_complete,
        data_register_empty: receive_complete + 1,
        transmit_complete: receive_complete + 2,
    }
}

/// The two-wire interface of the later parts, which is at the same addresses in all of them.
const fn later_twi(vector: u8) -> TwiRegisters {
    TwiRegisters { twbr: 0xb8, twsr: 0xb9, twar: 0xba, twdr: 0xbb, twcr: 0xbc, vector }
}

/// The EEPROM of the later parts, which is at the same addresses in all of them. A write takes 26368 cycles
/// of an 8 MHz oscillator, and each half of it 1.8 ms (table "EEPROM Mode Bits").
const fn later_eeprom(ready: u8, size: u16) -> EepromRegisters {
    EepromRegisters {
        eecr: 0x3f,
        eedr: 0x40,
        eearl: 0x41,
        eearh: 0x42,
        ready,
        size,
        write_micros: 26368 / 8,
        half_micros: Some(1800),
    }
}
