//! Arithmetic on integers of every width, signed and unsigned.

use crate::Checks;
use crate::random::Random;

pub fn run(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    unsigned(checks);
    signed(checks);
}

macro_rules! one {
    ($Type:ident) => {
        |random: &mut Random| $Type::from_le_bytes(random.bytes())
    };
}

/// Checks of the operations that all integers have.
macro_rules! integers {
    ($checks:ident, $($Type:ident)+) => {$(
        let two = |random: &mut Random| (one!($Type)(random), one!($Type)(random));
        $checks.check(concat!("add ", stringify!($Type)), |random| {
            let (a, b) = two(random);
            (a.overflowing_add(b), a.overflowing_sub(b), a.checked_add(b), a.wrapping_sub(1), a.wrapping_neg())
        });
        $checks.check(concat!("saturate ", stringify!($Type)), |random| {
            let (a, b) = two(random);
            (a.saturating_add(b), a.saturating_sub(b))
        });
        $checks.check(concat!("multiply ", stringify!($Type)), |random| {
            let (a, b) = two(random);
            (a.wrapping_mul(b), a.wrapping_mul(10), a.wrapping_mul(100), a.wrapping_mul(b).wrapping_mul(b))
        });
        $checks.check(concat!("divide ", stringify!($Type)), |random| {
            let (a, b) = two(random);
            (a.checked_div(b), a.checked_rem(b), a.checked_div_euclid(b), a.checked_rem_euclid(b))
        });
        $checks.check(concat!("divide by constants ", stringify!($Type)), |random| {
            let a = one!($Type)(random);
            (a / 3, a % 3, a / 7, a % 10, a / 10, a / 16, a % 16, a / 100)
        });
        $checks.check(concat!("compare ", stringify!($Type)), |random| {
            let (a, b) = two(random);
            (a.cmp(&b), a.min(b), a.max(b), a <= b, a == b, a < 10, a > 100, if a > b { a } else { 1 })
        });
        $checks.check(concat!("count bits ", stringify!($Type)), |random| {
            let a = one!($Type)(random);
            (a.count_ones(), a.leading_zeros(), a.trailing_zeros(), a.reverse_bits(), a.swap_bytes())
        });
        $checks.check(concat!("combine bits ", stringify!($Type)), |random| {
            let (a, b) = two(random);
            (a & b, a | b, a ^ b, !a, a & !b, a & 0x0f, a | 0x40, a ^ 0x7f)
        });
        $checks.check(concat!("convert ", stringify!($Type)), |random| {
            let a = one!($Type)(random);
            (a as u8, a as i8, a as u16, a as i16, a as u32, a as i32, a as u64, a as i64)
        });
    )+};
}

/// Checks of products with the carry out of them, except for `i32`: the function that the compiler calls for
/// it, `__mulosi4`, writes four bytes where the caller keeps two (docs/toolchain.md).
macro_rules! products {
    ($checks:ident, $($Type:ident)+) => {$(
        $checks.check(concat!("multiply with overflow ", stringify!($Type)), |random| {
            let (a, b) = (one!($Type)(random), one!($Type)(random));
            let (product, has_overflowed) = a.overflowing_mul(b);
            (product, has_overflowed, a.checked_mul(b), a.saturating_mul(b))
        });
    )+};
}

/// Checks of products in twice the width.
macro_rules! wide_products {
    ($checks:ident, $($Type:ident $Wide:ident)+) => {$(
        $checks.check(concat!("multiply ", stringify!($Type), " to ", stringify!($Wide)), |random| {
            let (a, b) = (one!($Type)(random), one!($Type)(random));
            let product = $Wide::from(a) * $Wide::from(b);
            (product, (product >> ($Wide::BITS / 2)) as $Type, product as $Type)
        });
    )+};
}

fn unsigned(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    integers!(checks, u8 u16 u32 u64);
    products!(checks, u8 u16 u32 u64);
    wide_products!(checks, u8 u16 u16 u32 u32 u64);
}

fn signed(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    integers!(checks, i8 i16 i32 i64);
    products!(checks, i8 i16 i64);
    wide_products!(checks, i8 i16 i16 i32 i32 i64);
}
