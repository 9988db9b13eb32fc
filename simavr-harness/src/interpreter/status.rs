//! The status register, and how arithmetic changes it (instruction set manual, "Status Register").
//!
//! Most flags are overwritten before the program reads them. So this keeps the values that the flags follow
//! from, and computes the flags only when they are read.

pub const CARRY: u8 = 0x01;
pub const ZERO: u8 = 0x02;
const NEGATIVE: u8 = 0x04;
const OVERFLOW: u8 = 0x08;
const SIGN: u8 = 0x10;
const HALF_CARRY: u8 = 0x20;
pub const TRANSFER: u8 = 0x40;
pub const INTERRUPT: u8 = 0x80;

/// The flags that arithmetic leaves alone.
const KEPT: u8 = TRANSFER | INTERRUPT;

/// SREG.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// The carry or borrow into each bit: the one into bit 8 is C, the one into bit 4 is H.
    carries: u32,
    /// V is set where bits 7 and 8, the carries into these bits, differ.
    overflow: u32,
    /// Bit 7 is N. Bit 8 is set where S is not N ^ V, which happens only when a program writes SREG.
    sign: u32,
    /// Z is set where this is 0.
    nonzero: u8,
    /// T and I.
    kept: u8,
}

impl Status {
    pub fn of_byte(byte: u8) -> Self {
        let flag = |mask| u32::from(byte & mask != 0);
        Self {
            carries: flag(CARRY) << 8 | flag(HALF_CARRY) << 4,
            overflow: flag(OVERFLOW) << 8,
            sign: flag(NEGATIVE) << 7 | (flag(SIGN) ^ flag(NEGATIVE) ^ flag(OVERFLOW)) << 8,
            nonzero: !byte & ZERO,
            kept: byte & KEPT,
        }
    }

    pub fn byte(self) -> u8 {
        let negative = self.sign >> 7 & 1;
        let overflow = (self.overflow >> 8 ^ self.overflow >> 7) & 1;
        let sign = negative ^ overflow ^ self.sign >> 8;
        let half_carry = self.carries >> 4 & 1;
        let result = negative << 2 | overflow << 3 | sign << 4 | half_carry << 5;
        result as u8 | self.carry() | u8::from(self.nonzero == 0) << 1 | self.kept
    }

    /// Whether any of the flags is set.
    pub fn has(self, mask: u8) -> bool {
        match mask {
            ZERO => self.nonzero == 0,
            CARRY => self.carry() != 0,
            _ => self.byte() & mask != 0,
        }
    }

    pub fn carry(self) -> u8 {
        (self.carries >> 8) as u8 & 1
    }

    pub fn set(&mut self, mask: u8, on: bool) {
        let others = self.byte() & !mask;
        *self = Self::of_byte(if on { others | mask } else { others });
    }

    /// `a + b + carry`, with all flags.
    pub fn add(&mut self, a: u8, b: u8, carry: u8) -> u8 {
        let sum = u32::from(a) + u32::from(b) + u32::from(carry);
        self.nonzero = sum as u8;
        self.sum(a, b, sum)
    }

    /// `a - b`, with all flags.
    pub fn subtract(&mut self, a: u8, b: u8) -> u8 {
        let difference = u32::from(a).wrapping_sub(u32::from(b));
        self.nonzero = difference as u8;
        self.sum(a, b, difference)
    }

    /// `a - b - carry`, with all flags. Z stays clear if it was, so that it tells of the whole of a long
    /// number.
    pub fn subtract_with_carry(&mut self, a: u8, b: u8) -> u8 {
        let difference = u32::from(a).wrapping_sub(u32::from(b)).wrapping_sub(u32::from(self.carry()));
        self.nonzero |= difference as u8;
        self.sum(a, b, difference)
    }

    /// Sets all flags but Z for `result`, a sum or a difference of `a` and `b`, and returns its low byte. A
    /// bit of `result` that differs from the exclusive OR of the operands' bits had a carry or a borrow into
    /// it.
    fn sum(&mut self, a: u8, b: u8, result: u32) -> u8 {
        self.carries = u32::from(a) ^ u32::from(b) ^ result;
        self.overflow = self.carries;
        self.sign = result & 0xff;
        result as u8
    }

    /// Sets Z, N and S for a result without overflow, and clears V.
    pub fn logic(&mut self, result: u8) {
        self.result(result, false);
    }

    /// Sets Z, N, V and S.
    pub fn result(&mut self, result: u8, overflow: bool) {
        self.overflow = u32::from(overflow) << 8;
        self.sign = result.into();
        self.nonzero = result;
    }

    fn set_carry(&mut self, carry: bool) {
        self.carries = self.carries & !0x100 | u32::from(carry) << 8;
    }

    /// Sets the flags of a shift to the right, which shifted out `carry`, 0 or 1.
    pub fn shift(&mut self, result: u8, carry: u8) {
        self.result(result, result >> 7 != carry);
        self.set_carry(carry != 0);
    }

    /// Sets the flags of the negation of `value`.
    pub fn negate(&mut self, value: u8, result: u8) {
        self.result(result, result == 0x80);
        self.carries = u32::from(result != 0) << 8 | u32::from(result | value) << 1 & 0x10;
    }

    /// Sets the flags of a word that is the result of an addition or a subtraction, ADIW or SBIW.
    pub fn word(&mut self, result: u16, carry: bool, overflow: bool) {
        self.result((result >> 8) as u8, overflow);
        self.nonzero |= result as u8;
        self.set_carry(carry);
    }

    /// Sets the flags of a product: Z and C.
    pub fn product(&mut self, product: u16) {
        self.nonzero = u8::from(product != 0);
        self.set_carry(product >> 15 != 0);
    }
}
