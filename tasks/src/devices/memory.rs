//! Keeps a record without power, in an EEPROM.
//!
//! Each record goes to the place after that of the one before, so that all places wear alike: 32 places last
//! for three million records. A number that counts up says which record is the newest. A CRC shows a place
//! that holds none: nothing was written there yet, the power failed during the write, or the place is worn.
//! Then the record before it counts. Each record is read back after it is written, and goes to the next place
//! if it is not there.
//!
//! ```text
//!   byte 0: number | bytes 1 to 4: record | bytes 5, 6: CRC-16 | byte 7 is free
//! ```

use crate::link::crc::Crc16;

/// A record: bytes whose meaning only the client knows.
pub type Record = [u8; 4];

/// How many places there are, from address 0 on.
pub const PLACES: u8 = 32;

/// The bytes of a place.
pub const PLACE: u16 = 8;

/// The bytes of a place that are written.
const LENGTH: u8 = 7;

/// The EEPROM's bytes, or as many of it as the [`PLACES`] take.
pub trait Cells {
    /// Whether no byte is being written. Only then may one be read or written.
    fn is_ready(&mut self) -> bool;

    /// The byte at `address`.
    fn recall(&mut self, address: u16) -> u8;

    /// Begins to write a byte.
    fn store(&mut self, address: u16, byte: u8);
}

/// The newest record, and where it is.
pub struct Memory {
    /// The newest record that is kept, or is to be.
    record: Option<Record>,
    is_kept: bool,
    /// The number and the place of the last record that is kept.
    number: u8,
    place: u8,
    /// The first byte of the present record that was not written in this place yet, and the places that did
    /// not take it.
    written: u8,
    worn: u8,
}

impl Memory {
    /// An EEPROM that was not read yet.
    pub const fn new() -> Self {
        Memory { record: None, is_kept: true, number: 0, place: PLACES - 1, written: 0, worn: 0 }
    }

    /// Reads the record that was kept last, if there is one. Call it before the first [step](Self::step). A
    /// record that was [to be kept](Self::keep) before that still is.
    #[inline(never)] // keeps its stack frame out of the caller's
    pub fn recall(&mut self, cells: &mut impl Cells) -> Option<Record> {
        let mut newest = None;
        for place in 0..PLACES {
            let mut crc = Crc16::new();
            let mut bytes = [0; LENGTH as usize];
            for (address, byte) in (address(place)..).zip(&mut bytes) {
                *byte = cells.recall(address);
                crc.update(*byte);
            }
            let [number, record @ .., _, _] = bytes;
            let is_newer = newest.is_none() || number.wrapping_sub(self.number) < 0x80;
            if crc.is_confirmed() && is_newer {
                (newest, self.number, self.place) = (Some(record), number, place);
            }
        }
        if self.is_kept {
            self.record = newest;
        }
        newest
    }

    /// Keeps this record instead of the one before; [`step`](Self::step) writes it from now on.
    pub fn keep(&mut self, record: Record) {
        if self.record != Some(record) {
            self.record = Some(record);
            self.is_kept = false;
            (self.written, self.worn) = (0, 0);
        }
    }

    /// Goes on writing the record that is to be kept. Returns whether to call it again, in a while.
    pub fn step(&mut self, cells: &mut impl Cells) -> bool {
        let Some(record) = self.record.filter(|_| !self.is_kept) else { return false };
        if !cells.is_ready() {
            return true;
        }
        let (number, place) = (self.number.wrapping_add(1), (self.place + 1) % PLACES);
        let mut is_worn = false;
        for (index, byte) in (0..).zip(bytes(number, record)) {
            let address = address(place) + u16::from(index);
            if cells.recall(address) == byte {
                continue;
            }
            if index >= self.written {
                self.written = index + 1;
                cells.store(address, byte);
                return true;
            }
            is_worn = true;
        }
        if is_worn {
            return self.next_place(place);
        }
        (self.number, self.place, self.is_kept) = (number, place, true);
        false
    }

    /// This place did not take the record. The bytes that it took spoil the record that was there: its number
    /// would look newer, once 128 more were kept.
    fn next_place(&mut self, place: u8) -> bool {
        (self.place, self.written) = (place, 0);
        self.worn += 1;
        // All places are worn: the record before stays the kept one.
        self.is_kept = self.worn == PLACES;
        !self.is_kept
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// Where a place begins.
fn address(place: u8) -> u16 {
    u16::from(place) * PLACE
}

/// The bytes that are written for a record.
fn bytes(number: u8, record: Record) -> [u8; LENGTH as usize] {
    let [a, b, c, d] = record;
    let mut crc = Crc16::new();
    for byte in [number, a, b, c, d] {
        crc.update(byte);
    }
    let [high, low] = crc.bytes();
    [number, a, b, c, d, high, low]
}

#[cfg(test)]
mod tests;
