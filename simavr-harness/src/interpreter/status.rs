//! The status register, and what the arithmetic does to it (instruction set manual, "Status Register").

pub const CARRY: u8 = 0x01;
pub const ZERO: u8 = 0x02;
const NEGATIVE: u8 = 0x04;
const OVERFLOW: u8 = 0x08;
const SIGN: u8 = 0x10;
const HALF_CARRY: u8 = 0x20;
pub const TRANSFER: u8 = 0x40;
pub const INTERRUPT: u8 = 0x80;

/// SREG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status(pub u8);

impl Status {
    pub fn has(self, mask: u8) -> bool {
        self.0 & mask != 0
    }

    pub fn carry(self) -> u8 {
        self.0 & CARRY
    }

    pub fn set(&mut self, mask: u8, on: bool) {
        self.replace(mask, if on { mask } else { 0 });
    }

    fn replace(&mut self, mask: u8, bits: u8) {
        self.0 = self.0 & !mask | bits;
    }

    /// `a + b + carry`, with all flags.
    pub fn add(&mut self, a: u8, b: u8, carry: u8) -> u8 {
        let sum = u32::from(a) + u32::from(b) + u32::from(carry);
        self.carries(a, b, sum);
        sum as u8
    }

    /// `a - b`, with all flags.
    pub fn subtract(&mut self, a: u8, b: u8) -> u8 {
        let difference = u32::from(a).wrapping_sub(u32::from(b));
        self.carries(a, b, difference);
        difference as u8
    }

    /// `a - b - carry`, with all flags; Z stays clear where it was, for the whole of a long number.
    pub fn subtract_with_carry(&mut self, a: u8, b: u8) -> u8 {
        let difference = u32::from(a).wrapping_sub(u32::from(b)).wrapping_sub(u32::from(self.carry()));
        let was_zero = self.0 & ZERO;
        self.carries(a, b, difference);
        self.0 &= !ZERO | was_zero;
        difference as u8
    }

    /// The flags of a sum or a difference of `a` and `b`. Where a bit of it is not what the operands' own would make
    /// there, a carry or a borrow came into it.
    fn carries(&mut self, a: u8, b: u8, result: u32) {
        let into = u32::from(a) ^ u32::from(b) ^ result;
        let carry = (into >> 8) as u8 & CARRY;
        let half = (into << 1) as u8 & HALF_CARRY;
        let overflow = ((into ^ into << 1) >> 5) as u8 & OVERFLOW;
        let kept = self.0 & (TRANSFER | INTERRUPT);
        self.0 = kept | carry | half | Self::of_result(result as u8, overflow);
    }

    /// Z, N and S of a result, and V as it is given.
    fn of_result(result: u8, overflow: u8) -> u8 {
        let negative = result >> 5 & NEGATIVE;
        let zero = u8::from(result == 0) << 1;
        zero | negative | overflow | (negative << 2 ^ overflow << 1)
    }

    /// Of a result without overflow: V is cleared.
    pub fn logic(&mut self, result: u8) {
        self.result(result, false);
    }

    /// Z, N, V and S.
    pub fn result(&mut self, result: u8, overflow: bool) {
        self.replace(ZERO | NEGATIVE | OVERFLOW | SIGN, Self::of_result(result, u8::from(overflow) << 3));
    }

    /// Of a shift to the right, which pushed out `carry`, 0 or 1.
    pub fn shift(&mut self, result: u8, carry: u8) {
        let overflow = result >> 7 != carry;
        self.result(result, overflow);
        self.replace(CARRY, carry);
    }

    /// Of the negation of `value`.
    pub fn negate(&mut self, value: u8, result: u8) {
        self.result(result, result == 0x80);
        self.set(CARRY, result != 0);
        self.set(HALF_CARRY, (result | value) & 0x08 != 0);
    }

    /// Of a word that comes of another by an addition or a subtraction. Both carry and overflow show in the sign.
    pub fn word(&mut self, result: u16, carry: bool, overflow: bool) {
        self.result((result >> 8) as u8, overflow);
        self.set(ZERO, result == 0);
        self.set(CARRY, carry);
    }

    /// Of a product.
    pub fn product(&mut self, product: u16) {
        self.set(ZERO, product == 0);
        self.set(CARRY, product >> 15 != 0);
    }
}
