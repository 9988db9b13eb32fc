//! The external interrupts of the ATmega128 (chapter "External Interrupts"), in place of simavr's. Edges of a
//! pin raise them, whether the program, a compare unit or the outside makes the edges; or a low level does,
//! as long as it lasts. simavr misses the rising edges of compare units, and a pin that is low before the
//! interrupt is enabled.
//!
//! Simplified: the reserved sense of INT0 to INT3 does nothing, nor does the level of a pin that floats.

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device};
use crate::part::Pin;
use crate::repair::interrupt;

const EIFR: u16 = 0x58;
const EIMSK: u16 = 0x59;
const EICRB: u16 = 0x5a;
const EICRA: u16 = 0x6a;

/// The vector of INT0; the others follow.
const FIRST: u8 = 1;

/// The pins, by the numbers of the interrupts, which are those of the pins' bits, too.
const PINS: [char; 8] = ['D', 'D', 'D', 'D', 'E', 'E', 'E', 'E'];

/// What raises an interrupt (ISCn).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sense {
    Low,
    Change,
    Falling,
    Rising,
    Nothing,
}

#[derive(Clone)]
pub(crate) struct External {
    vectors: [Vector; 8],
    /// The levels last seen at the pins.
    levels: u8,
}

/// Replaces simavr's interrupts by the harness's. `None`: the part has no such vectors.
pub(crate) fn attach(cpu: Cpu) -> Option<Attached<External>> {
    let vectors: Vec<_> = (FIRST..).take(PINS.len()).map_while(|number| cpu.vector(number)).collect();
    let external = External { vectors: vectors.try_into().ok()?, levels: 0 };
    let attached = Attached::new(cpu, external, &[EIFR, EIMSK, EICRA, EICRB], &[]);
    for (bit, port) in (0..).zip(PINS) {
        attached.watch_pin(cpu, port, bit);
    }
    Some(attached)
}

impl External {
    /// Call it after each reset, in which simavr connects its own signals again.
    pub fn reset(&mut self, cpu: Cpu) {
        for (bit, port) in (0..).zip(PINS) {
            cpu.disconnect_external_interrupt(Pin { port, bit });
        }
        self.levels = 0;
        (0..PINS.len()).for_each(|number| self.refresh(cpu, number));
    }

    /// The vector's interrupt was accepted: a low level raises it again.
    pub fn accepted(&self, cpu: Cpu, vector: u8) {
        let number = usize::from(vector.wrapping_sub(FIRST));
        if number < PINS.len() {
            self.refresh(cpu, number);
        }
    }

    fn sense(cpu: Cpu, number: usize) -> Sense {
        let (register, shift) = if number < 4 { (EICRA, 2 * number) } else { (EICRB, 2 * (number - 4)) };
        match cpu.data(register) >> shift & 3 {
            0 => Sense::Low,
            1 if number < 4 => Sense::Nothing,
            1 => Sense::Change,
            2 => Sense::Falling,
            _ => Sense::Rising,
        }
    }

    /// Makes an interrupt pending or not.
    fn refresh(&self, cpu: Cpu, number: usize) {
        let pin = Pin { port: PINS[number], bit: number as u8 };
        if Self::sense(cpu, number) == Sense::Low && !cpu.is_floating(pin) {
            self.follow_level(cpu, number, cpu.is_high(pin));
        } else {
            interrupt::refresh(cpu, self.vectors[number]);
        }
    }

    /// A low level raises an interrupt without a flag, as long as it lasts.
    fn follow_level(&self, cpu: Cpu, number: usize, is_high: bool) {
        let mask = 1 << number;
        let is_enabled = cpu.data(EIMSK) & mask != 0;
        interrupt::set_pending(cpu, self.vectors[number], is_enabled && !is_high);
        cpu.set_bits(EIFR, mask, false);
    }
}

impl Device for External {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        if address == EIFR {
            cpu.set_bits(EIFR, value, false);
        } else {
            cpu.set_data(address, value);
        }
        (0..PINS.len()).for_each(|number| self.refresh(cpu, number));
    }

    fn pin_changed(&mut self, cpu: Cpu, bit: u8, is_high: bool) {
        let (number, mask) = (usize::from(bit), 1 << bit);
        let is_edge = is_high != (self.levels & mask != 0);
        if !is_edge {
            return;
        }
        self.levels ^= mask;
        let is_wanted = match Self::sense(cpu, number) {
            Sense::Low => return self.follow_level(cpu, number, is_high),
            Sense::Change => true,
            Sense::Falling => !is_high,
            Sense::Rising => is_high,
            Sense::Nothing => false,
        };
        if is_wanted {
            cpu.raise(self.vectors[number]);
        }
    }
}
