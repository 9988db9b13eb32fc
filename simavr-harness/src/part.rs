//! Where the parts that the harness knows have their registers: data addresses and vector numbers,
//! from the datasheets' register summaries.

use thiserror::Error;

/// One microcontroller.
#[derive(Debug)]
pub struct Part {
    /// simavr's name, which is avr-gcc's `-mmcu`.
    pub name: &'static str,
    /// The on-chip debug register, which no program needs: writes to it are markers.
    pub(crate) ocdr: u16,
    /// In the order of their numbers.
    pub(crate) usarts: &'static [UsartRegisters],
    pub(crate) twi: TwiRegisters,
    pub(crate) eeprom: EepromRegisters,
    pub(crate) adc: AdcRegisters,
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
}

#[derive(Debug)]
pub(crate) struct AdcRegisters {
    pub adcl: u16,
    pub adch: u16,
    pub adcsra: u16,
    pub admux: u16,
    pub complete: u8,
}

/// There is no such part here.
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
        ocdr: 0x42,
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
        eeprom: EepromRegisters { eecr: 0x3c, eedr: 0x3d, eearl: 0x3e, eearh: 0x3f, ready: 22, size: 4096 },
        adc: AdcRegisters { adcl: 0x24, adch: 0x25, adcsra: 0x26, admux: 0x27, complete: 21 },
    };

    const ALL: [&'static Part; 1] = [Self::ATMEGA128];

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
}
