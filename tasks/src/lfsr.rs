//! A linear feedback shift register: numbers by chance for little flash.

/// A register of 16 bits after `SHIFTS` more shifts (Galois form, x^16 + x^14 + x^13 + x^11 + 1, period
/// 65535). Zero is the one state that it never leaves.
#[inline(always)] // a loop of its own, wherever it is used
pub fn shifted<const SHIFTS: u8>(mut register: u16) -> u16 {
    for _ in 0..SHIFTS {
        let carry = register & 1 != 0;
        register >>= 1;
        if carry {
            register ^= 0xB400;
        }
    }
    register
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_by_all_states_but_zero() {
        let mut register = 1;
        let period = (1..=u16::MAX).find(|_| {
            register = shifted::<1>(register);
            assert_ne!(register, 0);
            register == 1
        });
        assert_eq!(period, Some(u16::MAX));
        assert_eq!(shifted::<16>(0), 0);
    }
}
