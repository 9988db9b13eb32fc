//! The status register, and what the arithmetic does to it (instruction set manual, "Status Register").

pub const CARRY: u8 = 0x01;
pub const ZERO: u8 = 0x02;
const NEGATIVE: u8 = 0x04;
const OVERFLOW: u8 = 0x08;
const HALF_CARRY: u8 = 0x20;
pub const TRANSFER: u8 = 0x40;
pub const INTERRUPT: u8 = 0x80;

/// The flags that only carries and borrows change.
const CARRIES: u8 = CARRY | HALF_CARRY;

/// The flags that only instructions for them change.
const KEPT: u8 = TRANSFER | INTERRUPT;

/// SREG, in three parts: most instructions set one or two of them afresh and need not wait for what was there
/// before.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    carries: u8,
    /// Z, N, V and S.
    result: u8,
    kept: u8,
}

impl Status {
    pub fn of_byte(byte: u8) -> Self {
        Self { carries: byte & CARRIES, result: byte & !(CARRIES | KEPT), kept: byte & KEPT }
    }

    pub fn byte(self) -> u8 {
        self.carries | self.result | self.kept
    }

    pub fn has(self, mask: u8) -> bool {
        self.byte() & mask != 0
    }

    pub fn carry(self) -> u8 {
        self.carries & CARRY
    }

    pub fn set(&mut self, mask: u8, on: bool) {
        let others = self.byte() & !mask;
        *self = Self::of_byte(if on { others | mask } else { others });
    }

    /// `a + b + carry`, with all flags.
    pub fn add(&mut self, a: u8, b: u8, carry: u8) -> u8 {
        let sum = u32::from(a) + u32::from(b) + u32::from(carry);
        self.sum(a, b, sum);
        sum as u8
    }

    /// `a - b`, with all flags.
    pub fn subtract(&mut self, a: u8, b: u8) -> u8 {
        let difference = u32::from(a).wrapping_sub(u32::from(b));
        self.sum(a, b, difference);
        difference as u8
    }

    /// `a - b - carry`, with all flags; Z stays clear where it was, for the whole of a long number.
    pub fn subtract_with_carry(&mut self, a: u8, b: u8) -> u8 {
        let difference = u32::from(a).wrapping_sub(u32::from(b)).wrapping_sub(u32::from(self.carry()));
        let was_zero = self.result & ZERO;
        self.sum(a, b, difference);
        self.result &= !ZERO | was_zero;
        difference as u8
    }

    /// The flags of a sum or a difference of `a` and `b`. Where a bit of it is not what the operands' own
    /// would make there, a carry or a borrow came into it.
    fn sum(&mut self, a: u8, b: u8, result: u32) {
        let into = u32::from(a) ^ u32::from(b) ^ result;
        self.carries = (into >> 8) as u8 & CARRY | (into << 1) as u8 & HALF_CARRY;
        self.result = of_result(result as u8, ((into ^ into << 1) >> 5) as u8 & OVERFLOW);
    }

    /// Of a result without overflow: V is cleared.
    pub fn logic(&mut self, result: u8) {
        self.result = of_result(result, 0);
    }

    /// Z, N, V and S.
    pub fn result(&mut self, result: u8, overflow: bool) {
        self.result = of_result(result, if overflow { OVERFLOW } else { 0 });
    }

    /// Of a shift to the right, which pushed out `carry`, 0 or 1.
    pub fn shift(&mut self, result: u8, carry: u8) {
        self.result(result, result >> 7 != carry);
        self.carries = self.carries & !CARRY | carry;
    }

    /// Of the negation of `value`.
    pub fn negate(&mut self, value: u8, result: u8) {
        self.result(result, result == 0x80);
        self.carries = u8::from(result != 0) | (result | value) << 2 & HALF_CARRY;
    }

    /// Of a word that comes of another by an addition or a subtraction.
    pub fn word(&mut self, result: u16, carry: bool, overflow: bool) {
        // The high byte has the sign; a low byte that is not 0 keeps it from passing for 0.
        self.result((result >> 8) as u8 | u8::from(result as u8 != 0), overflow);
        self.carries = self.carries & !CARRY | u8::from(carry);
    }

    /// Of a product.
    pub fn product(&mut self, product: u16) {
        self.result = self.result & !ZERO | if product == 0 { ZERO } else { 0 };
        self.carries = self.carries & !CARRY | (product >> 15) as u8;
    }
}

/// Z, N and S of a result, and V as it is given.
fn of_result(result: u8, overflow: u8) -> u8 {
    let negative = result >> 5 & NEGATIVE;
    let zero = u8::from(result == 0) << 1;
    zero | negative | overflow | (negative << 2 ^ overflow << 1)
}
