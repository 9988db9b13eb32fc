//! What is known of the registers at a place in a program.

use std::collections::BTreeSet;

use crate::effect::Half;

/// What is known of a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Byte {
    Unknown,
    /// The value of this register at the start of the function.
    AtStart(u8),
    Is(u8),
    /// What was read from SREG.
    Status,
    /// Its highest bit, which enables interrupts in SREG, is set or clear; the others are unknown.
    Highest(bool),
    /// A byte of the stack pointer's value with so many bytes on the stack.
    OfStackPointer(Half, i32),
}

const HIGHEST: u8 = 0x80;

impl Byte {
    /// Its highest bit, if that is known.
    pub fn highest(self) -> Option<bool> {
        match self {
            Byte::Is(value) => Some(value & HIGHEST != 0),
            Byte::Highest(is_set) => Some(is_set),
            Byte::Unknown | Byte::AtStart(_) | Byte::Status | Byte::OfStackPointer(..) => None,
        }
    }

    /// With these bits set.
    pub fn with(self, bits: u8) -> Self {
        match self {
            Byte::Is(value) => Byte::Is(value | bits),
            _ if bits & HIGHEST != 0 => Byte::Highest(true),
            _ => Self::of_highest(self.highest()),
        }
    }

    /// With the bits clear that are clear in `bits`.
    pub fn within(self, bits: u8) -> Self {
        match self {
            Byte::Is(value) => Byte::Is(value & bits),
            _ if bits & HIGHEST == 0 => Byte::Highest(false),
            _ => Self::of_highest(self.highest()),
        }
    }

    fn of_highest(is_set: Option<bool>) -> Self {
        is_set.map_or(Byte::Unknown, Byte::Highest)
    }
}

/// The possible values of a pair of registers, a few at most, low byte first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair(BTreeSet<[Byte; 2]>);

/// Where a stack pointer points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StackPointer {
    /// The stack on which the function was called, with so many bytes on it.
    Own(i32),
    /// An address that the program names.
    Fixed(u16),
    /// Another stack, after a context switch; which one is unknown.
    Elsewhere,
}

/// More possibilities than these count as unknown.
const MOST: usize = 8;

impl Pair {
    pub fn unknown() -> Self {
        Self::only([Byte::Unknown; 2])
    }

    fn only(bytes: [Byte; 2]) -> Self {
        Pair(BTreeSet::from([bytes]))
    }

    fn map(&self, change: impl Fn([Byte; 2]) -> [Byte; 2]) -> Self {
        Pair(self.0.iter().copied().map(change).collect())
    }

    fn join(&mut self, other: &Pair) {
        self.0.extend(&other.0);
        if self.0.len() > MOST || self.0.contains(&[Byte::Unknown; 2]) {
            *self = Self::unknown();
        }
    }

    fn byte(&self, half: usize) -> Byte {
        let mut bytes = self.0.iter().map(|bytes| bytes[half]);
        let first = bytes.next().unwrap_or(Byte::Unknown);
        if bytes.all(|byte| byte == first) { first } else { Byte::Unknown }
    }

    /// Its value as a stack pointer.
    pub fn stack_pointer(&self) -> StackPointer {
        match [self.byte(0), self.byte(1)] {
            [Byte::Is(low), Byte::Is(high)] => StackPointer::Fixed(u16::from_le_bytes([low, high])),
            [Byte::OfStackPointer(Half::Low, low), Byte::OfStackPointer(Half::High, high)] if low == high => {
                StackPointer::Own(low)
            }
            _ => StackPointer::Elsewhere,
        }
    }

    /// All possible values, if they are known.
    pub fn values(&self) -> Option<Vec<u16>> {
        let value = |bytes: &[Byte; 2]| match *bytes {
            [Byte::Is(low), Byte::Is(high)] => Some(u16::from_le_bytes([low, high])),
            _ => None,
        };
        self.0.iter().map(value).collect()
    }
}

/// The 32 registers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Registers([Pair; 16]);

/// The registers that survive every call, Y: a switch to another task preserves no others.
pub const PRESERVED: u32 = 0b11 << 28;

impl Registers {
    /// At the start of a function.
    pub fn at_start() -> Self {
        let mut registers = Self::unknown();
        (0..32).for_each(|register| registers.set(register, Byte::AtStart(register)));
        registers
    }

    pub fn unknown() -> Self {
        Registers(std::array::from_fn(|_| Pair::unknown()))
    }

    /// The registers that hold their value from the start, a bit each.
    pub fn preserved(&self) -> u32 {
        (0..32)
            .filter(|&register| self.byte(register) == Byte::AtStart(register))
            .map(|register| 1 << register)
            .sum()
    }

    /// The pair that a register belongs to.
    pub fn pair(&self, register: u8) -> &Pair {
        &self.0[usize::from(register / 2)]
    }

    pub fn byte(&self, register: u8) -> Byte {
        self.pair(register).byte(usize::from(register % 2))
    }

    pub fn set(&mut self, register: u8, byte: Byte) {
        let pair = &mut self.0[usize::from(register / 2)];
        *pair = pair.map(|mut bytes| {
            bytes[usize::from(register % 2)] = byte;
            bytes
        });
    }

    pub fn copy_pair(&mut self, to: u8, from: u8) {
        self.0[usize::from(to / 2)] = self.pair(from).clone();
    }

    pub fn add(&mut self, low: u8, amount: i16) {
        let pair = &mut self.0[usize::from(low / 2)];
        *pair = pair.map(|bytes| match Pair::only(bytes).stack_pointer() {
            StackPointer::Own(depth) => {
                [Half::Low, Half::High].map(|half| Byte::OfStackPointer(half, depth - i32::from(amount)))
            }
            StackPointer::Fixed(value) => value.wrapping_add_signed(amount).to_le_bytes().map(Byte::Is),
            StackPointer::Elsewhere => [Byte::Unknown; 2],
        });
    }

    /// Marks the registers whose bits are set as unknown.
    pub fn forget(&mut self, registers: u32) {
        for register in (0..32).filter(|register| registers >> register & 1 != 0) {
            self.set(register, Byte::Unknown);
        }
    }

    /// What is known where two paths meet.
    pub fn join(&mut self, other: &Registers) {
        for (pair, other) in self.0.iter_mut().zip(&other.0) {
            pair.join(other);
        }
    }
}
