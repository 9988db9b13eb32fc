//! Memory: slices, copies, frames larger than an instruction's reach, tables in flash.

use core::hint::black_box;

use crate::Checks;
use crate::random::Random;

pub fn run(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    slices(checks);
    places(checks);
}

fn slices(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    checks.check("index with a check", |random| {
        let bytes: [u8; 9] = random.bytes();
        let (from, to) = (usize::from(random.byte() & 15), usize::from(random.byte() & 15));
        (bytes.get(from).copied(), bytes.get(from..to).map(<[u8]>::len), bytes.last().copied())
    });
    checks.check("split and chunk", |random| {
        let bytes: [u8; 11] = random.bytes();
        let (head, tail) = bytes.split_at(usize::from(random.byte() % 12));
        let chunks = bytes.chunks(3).fold(0u16, |sum, chunk| sum.wrapping_mul(31) ^ word(chunk));
        (word(head), word(tail), chunks, bytes.windows(2).filter(|pair| pair[0] < pair[1]).count())
    });
    checks.check("sort bytes", |random| {
        let mut bytes: [u8; 12] = random.bytes();
        bytes.sort_unstable();
        (bytes, bytes.binary_search(&random.byte()).is_ok())
    });
    checks.check("sort words by a key", |random| {
        let mut words: [i16; 9] = core::array::from_fn(|_| random.word() as i16);
        words.sort_unstable_by_key(|word| core::cmp::Reverse(word.wrapping_abs()));
        words.map(i16::wrapping_abs)
    });
    checks.check("rotate and reverse", |random| {
        let mut bytes: [u8; 10] = random.bytes();
        bytes.rotate_left(usize::from(random.byte() % 10));
        bytes.swap(0, usize::from(random.byte() % 10));
        bytes
    });
    checks.check("copy within", |random| {
        let mut bytes: [u8; 20] = random.bytes();
        bytes.copy_within(..13, usize::from(random.byte() & 7));
        bytes.copy_within(4.., usize::from(random.byte() & 3));
        bytes
    });
    checks.check("fill and compare", |random| {
        let mut bytes: [u8; 15] = random.bytes();
        let middle = black_box(3)..usize::from(random.byte() & 7) + 4;
        bytes[middle].fill(random.byte());
        (bytes, bytes[..7].cmp(&bytes[8..]), bytes[..7] == bytes[1..8])
    });
    checks.check("search", |random| {
        let bytes: [u8; 16] = random.bytes();
        let first = bytes.iter().position(|byte| *byte == 0);
        let last = bytes.iter().rposition(|byte| *byte > 0x7f);
        (first, last, bytes.iter().copied().max(), bytes.iter().map(|byte| u16::from(*byte)).sum::<u16>())
    });
    checks.check("iterate backwards in steps", |random| {
        let bytes: [u8; 16] = random.bytes();
        let steps = bytes.iter().rev().step_by(3).zip(&bytes).skip(1);
        steps.fold(0u32, |sum, (a, b)| sum.wrapping_mul(7) ^ u32::from(*a) << 8 ^ u32::from(*b))
    });
    checks.check("text in UTF-8", |random| {
        let bytes: [u8; 3] = [0xc3, 0x80 | random.byte() & 0x3f, random.byte()];
        core::str::from_utf8(&bytes).map_or(0, |text| text.chars().fold(0, |sum, c| sum * 31 + u32::from(c)))
    });
    checks.check("decimal digits", |random| {
        let (mut number, mut digits) = (random.word(), [0; 5]);
        for digit in digits.iter_mut().rev() {
            *digit = b'0' + (number % 10) as u8;
            number /= 10;
        }
        (digits, core::str::from_utf8(&digits).ok().and_then(|digits| digits.parse::<u16>().ok()))
    });
}

#[inline(never)]
fn word(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |sum: u16, byte| sum.rotate_left(5) ^ u16::from(*byte))
}

kernel::flash! {
    static SQUARES: [u16; 16] = [0, 1, 4, 9, 16, 25, 36, 49, 64, 81, 100, 121, 144, 169, 196, 65535];
}

fn places(checks: &mut Checks<impl FnMut(&'static str, u32)>) {
    checks.check("tables in flash", |random| (SQUARES.get(random.byte().into()), SQUARES.iter().max()));
    checks.check("tables in RAM", |random| {
        let table = black_box(&[3u32, 0x0001_0000, 0xffff_ffff, 5, 0x8000_0000, 7, 8, 9]);
        table.get(usize::from(random.byte() & 15)).copied()
    });
    checks.check("fields out of an instruction's reach", |random| {
        let mut record = Record::new(random);
        change(&mut record);
        (record.first, record.last, record.padding[66], record.middle)
    });
    checks.check("a frame out of an instruction's reach", |random| {
        let mut frame = [0u16; 80];
        scatter(&mut frame, random);
        let (low, high) = frame.split_at(40);
        (low.iter().fold(0, fold), high.iter().rev().fold(1, fold), frame[0], frame[79])
    });
    checks.check("two frames of one size", |random| {
        let (mut a, mut b) = (random.bytes::<40>(), random.bytes::<40>());
        core::mem::swap(&mut a, &mut b);
        exchange(&mut a, &mut b);
        (a, b)
    });
    checks.check("values that stand for more than one byte", |random| {
        let mut bytes: [u8; 12] = random.bytes();
        let (a, b) = bytes.split_at_mut(6);
        a[1..5].copy_from_slice(&u32::from_be_bytes([b[0], b[2], b[3], b[1]]).rotate_left(9).to_le_bytes());
        bytes
    });
    checks.check("checksum of frames", |random| {
        random.bytes::<14>().iter().fold(0xffff, |crc: u16, byte| {
            (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| {
                if crc & 0x8000 != 0 { crc << 1 ^ 0x1021 } else { crc << 1 }
            })
        })
    });
}

/// More than 63 bytes: `ldd` and `std` reach no further.
struct Record {
    first: u32,
    padding: [u8; 67],
    middle: u8,
    last: u64,
}

impl Record {
    #[inline(never)]
    fn new(random: &mut Random) -> Self {
        let (first, last) = (u32::from_le_bytes(random.bytes()), u64::from_le_bytes(random.bytes()));
        Record { first, padding: [random.byte(); 67], middle: random.byte(), last }
    }
}

#[inline(never)]
fn change(record: &mut Record) {
    record.first = record.first.wrapping_add(record.last as u32);
    record.padding[66] ^= record.padding[0].wrapping_add(record.middle);
    record.last = record.last.wrapping_mul(3) ^ u64::from(record.first);
    record.middle = record.last.to_le_bytes()[7];
}

#[inline(never)]
fn scatter(frame: &mut [u16; 80], random: &mut Random) {
    for _ in 0..40 {
        let index = usize::from(random.byte() % 80);
        frame[index] = random.word();
    }
}

fn fold(sum: u16, word: &u16) -> u16 {
    sum.wrapping_mul(33) ^ *word
}

#[inline(never)]
fn exchange(a: &mut [u8; 40], b: &mut [u8; 40]) {
    for (a, b) in a.iter_mut().zip(b.iter_mut().rev()) {
        (*a, *b) = (*b, a.wrapping_add(*b));
    }
}
