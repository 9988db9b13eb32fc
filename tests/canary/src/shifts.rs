//! Shifts and rotations: the AVR moves by one bit only, so each amount is code of its own.

use crate::Checks;

/// A check with each amount as a constant, and one with an amount that is known only as it runs.
macro_rules! shifts {
    ($checks:ident, $Type:ident, $($amount:literal)+) => {
        $checks.check(concat!("shift by constants ", stringify!($Type)), |random| {
            let a = $Type::from_le_bytes(random.bytes());
            [$((a << $amount, a >> $amount, a.rotate_left($amount))),+]
        });
        $checks.check(concat!("shift ", stringify!($Type)), |random| {
            let a = $Type::from_le_bytes(random.bytes());
            let amount = u32::from(random.byte());
            (a.wrapping_shl(amount), a.wrapping_shr(amount), a.rotate_right(amount), a.checked_shl(amount))
        });
    };
}

pub fn run(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    shifts!(checks, u8, 1 2 3 4 5 6 7);
    shifts!(checks, i8, 1 2 3 4 5 6 7);
    shifts!(checks, u16, 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15);
    shifts!(checks, i16, 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15);
    shifts!(checks, u32, 1 2 4 7 8 9 12 15 16 17 20 23 24 25 28 31);
    shifts!(checks, i32, 1 2 4 7 8 9 12 15 16 17 20 23 24 25 28 31);
    shifts!(checks, u64, 1 4 7 8 9 15 16 24 31 32 33 40 48 56 63);
    shifts!(checks, i64, 1 4 7 8 9 15 16 24 31 32 33 40 48 56 63);
    checks.check("sign i16", |random| sign(random.word() as i16));
}

/// -1 or 0.
#[inline(never)]
fn sign(value: i16) -> i16 {
    if cfg!(feature = "fault-shift") {
        return ((value as u16) >> 15) as i16; // the result of a compiler that forgets the sign
    }
    value >> 15
}
