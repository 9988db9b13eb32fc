extern crate std;

use std::vec;
use std::vec::Vec;

use super::*;

const BYTES: usize = PLACES as usize * PLACE as usize;

/// An EEPROM that is ready each third time, and some of whose places are worn: they keep what they hold.
struct Eeprom {
    bytes: [u8; BYTES],
    writes: [u32; BYTES],
    worn: Vec<u16>,
    busy: u8,
}

impl Eeprom {
    fn of(byte: u8) -> Self {
        Eeprom { bytes: [byte; BYTES], writes: [0; BYTES], worn: Vec::new(), busy: 0 }
    }
}

impl Cells for Eeprom {
    fn is_ready(&mut self) -> bool {
        self.busy = self.busy.saturating_sub(1);
        self.busy == 0
    }

    fn recall(&mut self, address: u16) -> u8 {
        assert_eq!(self.busy, 0, "it can't be read while it is written");
        self.bytes[usize::from(address)]
    }

    fn store(&mut self, address: u16, byte: u8) {
        assert_eq!(self.busy, 0);
        let index = usize::from(address);
        self.writes[index] += 1;
        if !self.worn.contains(&address) {
            self.bytes[index] = byte;
        }
        self.busy = 3;
    }
}

/// The record that a program reads when it starts.
fn recalled(eeprom: &mut Eeprom) -> Option<Record> {
    eeprom.busy = 0;
    Memory::new().recall(eeprom)
}

/// Keeps a record; after so many bytes the power fails. Returns whether it was kept.
fn keep(memory: &mut Memory, eeprom: &mut Eeprom, record: Record, bytes: u32) -> bool {
    memory.keep(record);
    let limit = eeprom.writes.iter().sum::<u32>().saturating_add(bytes);
    for _ in 0..2_000 {
        if !memory.step(eeprom) {
            return true;
        }
        if eeprom.writes.iter().sum::<u32>() == limit {
            return false;
        }
    }
    panic!("it has no end");
}

fn record(number: u32) -> Record {
    number.to_le_bytes()
}

#[test]
fn what_was_kept_last_is_recalled_and_all_places_wear_alike() {
    let mut eeprom = Eeprom::of(0xFF);
    let mut memory = Memory::new();
    assert_eq!(memory.recall(&mut eeprom), None);
    let rounds = 40;
    for number in 0..rounds * u32::from(PLACES) {
        assert!(keep(&mut memory, &mut eeprom, record(number * 77_777), u32::MAX));
        assert_eq!(recalled(&mut eeprom), Some(record(number * 77_777)));
        if number % 7 == 0 {
            memory = Memory::new();
            eeprom.busy = 0;
            memory.recall(&mut eeprom);
        }
    }
    assert!(eeprom.writes.iter().all(|&writes| writes <= rounds), "{:?}", eeprom.writes);
}

/// A record is kept beyond the image that has written it.
#[test]
fn each_record_lies_where_other_images_look_for_it() {
    let mut eeprom = Eeprom::of(0xFF);
    let mut memory = Memory::new();
    for number in 1..=33 {
        assert!(keep(&mut memory, &mut eeprom, [number, 2, 3, 4], u32::MAX));
    }
    for (address, bytes) in [
        (0, [33, 33, 2, 3, 4, 0x76, 0x5B, 0xFF]),
        (8, [2, 2, 2, 3, 4, 0x3C, 0xAF, 0xFF]),
        (248, [32, 32, 2, 3, 4, 0xAA, 0xBE, 0xFF]),
    ] {
        assert_eq!(eeprom.bytes[address..address + 8], bytes, "{address}");
    }
    assert_eq!(BYTES, 256);
}

#[test]
fn what_is_there_already_is_not_written() {
    let mut eeprom = Eeprom::of(0xFF);
    let mut memory = Memory::new();
    assert!(keep(&mut memory, &mut eeprom, record(5), u32::MAX));
    let writes = eeprom.writes;
    assert!(keep(&mut memory, &mut eeprom, record(5), u32::MAX));
    let mut again = Memory::new();
    eeprom.busy = 0;
    assert_eq!(again.recall(&mut eeprom), Some(record(5)));
    assert!(keep(&mut again, &mut eeprom, record(5), u32::MAX));
    assert_eq!(eeprom.writes, writes);
}

#[test]
fn nothing_is_recalled_of_what_is_blank_or_garbage() {
    for byte in 0..=0xFF {
        assert_eq!(recalled(&mut Eeprom::of(byte)), None, "{byte:#x}");
    }
}

#[test]
fn whenever_the_power_fails_the_record_before_counts_until_the_new_one_is_whole() {
    for before in 0..70 {
        for bytes in 1..=u32::from(LENGTH) {
            for garbled in [None, Some(0x00), Some(0x5A), Some(0xFF)] {
                let mut eeprom = Eeprom::of(0xFF);
                let mut memory = Memory::new();
                (0..before).for_each(|number| _ = keep(&mut memory, &mut eeprom, record(number), u32::MAX));
                let last = before.checked_sub(1).map(record);
                let written = eeprom.writes;
                let is_kept = keep(&mut memory, &mut eeprom, record(0xC0FF_EE00 + before), bytes);
                // The byte that was being written may be anything.
                let now =
                    eeprom.writes.iter().zip(written).rposition(|(now, before)| *now != before).unwrap();
                let whole = eeprom.bytes[now];
                eeprom.bytes[now] = garbled.unwrap_or(whole);
                let is_whole = bytes == u32::from(LENGTH) && eeprom.bytes[now] == whole || is_kept;
                let recalled = recalled(&mut eeprom);
                if is_whole && garbled.is_none() {
                    assert_eq!(recalled, Some(record(0xC0FF_EE00 + before)));
                } else if eeprom.bytes[now] != whole {
                    assert_eq!(recalled, last, "{before}, {bytes}");
                }
                // A program that starts then keeps the next record.
                let mut memory = Memory::new();
                memory.recall(&mut eeprom);
                assert!(keep(&mut memory, &mut eeprom, record(7_000_000), u32::MAX));
                eeprom.busy = 0;
                assert_eq!(Memory::new().recall(&mut eeprom), Some(record(7_000_000)));
            }
        }
    }
}

#[test]
fn a_worn_place_is_passed_by_and_where_all_are_worn_it_ends() {
    let mut eeprom = Eeprom::of(0xFF);
    eeprom.worn = vec![1, 2 * PLACE + 6, 3 * PLACE];
    let mut memory = Memory::new();
    for number in 1..100 {
        let wanted = record(number * 0x0101_0101);
        assert!(keep(&mut memory, &mut eeprom, wanted, u32::MAX));
        assert_eq!(recalled(&mut eeprom), Some(wanted), "{number}");
        eeprom.busy = 0;
    }
    eeprom.worn = (0..BYTES as u16).collect();
    let last = recalled(&mut eeprom);
    assert!(keep(&mut memory, &mut eeprom, record(1), u32::MAX));
    assert_eq!(recalled(&mut eeprom), last);
}

/// The number of an old record that is still whole looks newer, once 128 more were kept.
#[test]
fn an_old_record_in_a_place_of_which_a_byte_is_worn_does_not_come_back() {
    for byte in 0..u16::from(LENGTH) {
        let mut eeprom = Eeprom::of(0xFF);
        let mut memory = Memory::new();
        for number in 1..600 {
            let wanted = record(number * 77_777);
            assert!(keep(&mut memory, &mut eeprom, wanted, u32::MAX));
            assert_eq!(recalled(&mut eeprom), Some(wanted), "byte {byte}, {number}");
            eeprom.busy = 0;
            if number == 40 {
                eeprom.worn = vec![5 * PLACE + byte];
            }
        }
    }
}

#[test]
fn a_record_that_comes_while_another_is_written_takes_its_place() {
    for bytes in 1..=u32::from(LENGTH) {
        let mut eeprom = Eeprom::of(0xFF);
        let mut memory = Memory::new();
        assert!(keep(&mut memory, &mut eeprom, record(1), u32::MAX));
        keep(&mut memory, &mut eeprom, record(0x0202_0202), bytes);
        for (wanted, bytes) in [(record(0x0303_0303), u32::MAX), (record(1), u32::MAX)] {
            assert!(keep(&mut memory, &mut eeprom, wanted, bytes));
            assert_eq!(recalled(&mut eeprom), Some(wanted));
        }
    }
}
