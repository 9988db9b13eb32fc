//! The words of a command, and the numbers in them: all are hexadecimal.

/// The words of `line`, separated by white space.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The number in `word`, if it has 1 to `digits` digits; `digits` is at most 4.
pub(super) fn number(word: &[u8], digits: usize) -> Option<u16> {
    if word.is_empty() || word.len() > digits {
        return None;
    }
    word.iter().try_fold(0, |number: u16, byte| Some(number << 4 | u16::from(digit(*byte)?)))
}

fn digit(byte: u8) -> Option<u8> {
    match byte {
        b'0'..=b'9' => Some(byte.wrapping_sub(b'0')),
        b'a'..=b'f' => Some(byte.wrapping_sub(b'a').wrapping_add(10)),
        b'A'..=b'F' => Some(byte.wrapping_sub(b'A').wrapping_add(10)),
        _ => None,
    }
}

/// The digit of the low four bits of `value`.
pub(super) fn to_digit(value: u8) -> u8 {
    match value & 0x0f {
        value @ 0..=9 => b'0'.wrapping_add(value),
        value => b'a'.wrapping_sub(10).wrapping_add(value),
    }
}
