//! The memory that a module keeps without power, natively: a byte is written at once.

use tasks::devices::memory::{Cells, PLACE, PLACES};

const SIZE: usize = PLACES as usize * PLACE as usize;

/// An EEPROM. Its memory is allocated when it is first written.
#[derive(Default)]
pub struct Eeprom(Option<Box<[u8; SIZE]>>);

impl Cells for Eeprom {
    fn is_ready(&mut self) -> bool {
        true
    }

    fn recall(&mut self, address: u16) -> u8 {
        self.0.as_ref().map_or(0xFF, |bytes| bytes[usize::from(address)])
    }

    fn store(&mut self, address: u16, byte: u8) {
        self.0.get_or_insert_with(|| Box::new([0xFF; SIZE]))[usize::from(address)] = byte;
    }
}
