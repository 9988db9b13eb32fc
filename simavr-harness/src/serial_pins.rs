//! The wire at a serial port that a program makes of two pins, in software. It turns edges into characters
//! and characters into edges.
//!
//! It samples what the program sends in the middle of each bit, as the USART at the other end would, so that
//! jitter has its effect. 8 data bits, no parity, 1 stop bit, at 38400 baud.

use std::collections::VecDeque;

use tasks::superbot::{BAUD, CLOCK_HZ};

use crate::character::{BITS, Character};
use crate::cpu::{Cpu, News};
use crate::device::{Attached, Device};
use crate::part::Pin;

/// The pins of a serial port in software. An idle line is high.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SerialPins {
    pub receive: Pin,
    pub transmit: Pin,
}

/// The counts of a serial port in software since power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SerialPinCounts {
    /// Characters sent.
    pub sent: u64,
    /// Characters sent whose stop bit was low. They are not delivered.
    pub framing_errors: u64,
    /// Characters whose edges came in.
    pub received: u64,
}

pub(crate) struct PinSerial {
    pins: SerialPins,
    sender: Sender,
    /// The edges to come at the receiving pin: the cycle of each, and the level after it.
    edges: VecDeque<(u64, bool)>,
    counts: SerialPinCounts,
}

/// Decodes the level of the transmitting pin.
struct Sender {
    level: bool,
    /// Start of the character under way.
    start: Option<u64>,
    /// Edges since then.
    edges: Vec<(u64, bool)>,
    /// Characters that have ended since they were last taken.
    sent: Vec<Character>,
}

/// Makes a serial port of two pins of the MCU.
pub(crate) fn attach(cpu: Cpu, pins: SerialPins) -> Attached<PinSerial> {
    let attached = Attached::new(cpu, PinSerial::new(pins), &[], &[]);
    attached.watch_pin(cpu, pins.transmit.port, pins.transmit.bit);
    cpu.drive_pin(pins.receive.port, pins.receive.bit, true);
    attached
}

impl PinSerial {
    fn new(pins: SerialPins) -> Self {
        let sender = Sender { level: true, start: None, edges: Vec::new(), sent: Vec::new() };
        PinSerial { pins, sender, edges: VecDeque::new(), counts: SerialPinCounts::default() }
    }

    /// The program's pins are inputs again: the line is idle.
    pub fn reset(&mut self) {
        self.sender.level = true;
        self.sender.start = None;
    }

    /// Whether there are characters to be taken.
    pub fn has_sent(&self) -> bool {
        !self.sender.sent.is_empty()
    }

    /// Takes the characters that have ended since the last call, in order.
    pub fn take_sent(&mut self) -> Vec<Character> {
        std::mem::take(&mut self.sender.sent)
    }

    /// A character comes in, with its first edge at its start. Calls may come in any order of their starts.
    pub fn receive(&mut self, character: Character) {
        for edge in character.edges() {
            let place = self.edges.partition_point(|(at, _)| *at <= edge.0);
            self.edges.insert(place, edge);
        }
        self.counts.received += 1;
    }

    pub fn counts(&self) -> SerialPinCounts {
        self.counts
    }
}

/// Cycles of `number` halves of a bit.
fn half_bits(number: u64) -> u64 {
    number * u64::from(CLOCK_HZ) / (2 * u64::from(BAUD))
}

impl Sender {
    /// The cycle at which the character under way can be read: in the middle of its stop bit.
    fn due(&self) -> Option<u64> {
        self.start.map(|start| start + half_bits(2 * BITS - 1))
    }

    fn edge(&mut self, at: u64, level: bool) {
        if level == self.level {
            return;
        }
        self.level = level;
        if self.start.is_some() {
            self.edges.push((at, level));
        } else if !level {
            self.start = Some(at);
            self.edges.clear();
        }
    }

    /// The character that began at `start`; `None` if its stop bit is low.
    fn character(&self, start: u64) -> Option<Character> {
        let level_in_bit = |bit: u64| {
            let middle = start + half_bits(2 * bit + 1);
            self.edges.iter().rev().find(|edge| edge.0 <= middle).is_some_and(|edge| edge.1)
        };
        let value = (0..8).fold(0, |value, bit| value | u8::from(level_in_bit(bit + 1)) << bit);
        level_in_bit(BITS - 1).then(|| Character { value, start, end: start + half_bits(2 * BITS) })
    }
}

impl Device for PinSerial {
    fn write(&mut self, _cpu: Cpu, _address: u16, _value: u8) {
        // It has no register.
    }

    fn due(&self) -> Option<u64> {
        [self.sender.due(), self.edges.front().map(|edge| edge.0)].into_iter().flatten().min()
    }

    fn expire(&mut self, cpu: Cpu, now: u64) {
        if self.sender.due() == Some(now)
            && let Some(start) = self.sender.start.take()
        {
            match self.sender.character(start) {
                Some(character) => {
                    self.sender.sent.push(character);
                    cpu.tell(News::Sent);
                    self.counts.sent += 1;
                }
                None => self.counts.framing_errors += 1,
            }
        }
        while let Some(&(_, level)) = self.edges.front().filter(|edge| edge.0 <= now) {
            self.edges.pop_front();
            cpu.drive_pin(self.pins.receive.port, self.pins.receive.bit, level);
        }
    }

    fn pin_changed(&mut self, cpu: Cpu, _bit: u8, level: bool) {
        self.sender.edge(cpu.cycle(), level);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::Pin;

    #[test]
    fn what_comes_in_sooner_comes_first_whenever_that_is_told() {
        let pin = |bit| Pin { port: 'E', bit };
        let mut serial = PinSerial::new(SerialPins { receive: pin(7), transmit: pin(5) });
        for start in [50_000, 10_000, 30_000] {
            serial.receive(Character { value: 0x55, start, end: start + 4_160 });
        }
        assert_eq!(serial.edges.len(), 30);
        assert!(serial.edges.iter().is_sorted());
    }
}
