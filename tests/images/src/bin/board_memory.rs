//! Copies and fills every length from 0 to 300 bytes, and checks these bytes and the bytes around. Marks the
//! lengths with a fault, modulo 256, and in the end 0x55.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::ptr;

use board::Board;
use board::debug::mark;
use kernel::{Priority, Stack};
use tests_images::{finish, start};

/// The longest length, and bytes around it.
const SPACE: usize = 304;

static TASK: Stack<1000> = Stack::new();

/// Whether the bytes from 2 on, `length` of them, are `expected`, and all others still 0xa5.
fn is_right(bytes: &[u8; SPACE], length: usize, expected: impl Fn(usize) -> u8) -> bool {
    bytes.iter().enumerate().all(|(place, byte)| {
        *byte == if (2..2 + length).contains(&place) { expected(place - 2) } else { 0xa5 }
    })
}

fn exercise() {
    let source: [u8; SPACE] = core::array::from_fn(|place| place as u8 ^ 0x3c);
    for length in 0..=300 {
        let mut copied = [0xa5_u8; SPACE];
        let mut filled = copied;
        // SAFETY: both have the length and two bytes before it.
        unsafe {
            ptr::copy_nonoverlapping(source.as_ptr(), copied.as_mut_ptr().add(2), black_box(length));
            ptr::write_bytes(filled.as_mut_ptr().add(2), black_box(0x5a), black_box(length));
        }
        let is_copied = is_right(black_box(&copied), length, |place| place as u8 ^ 0x3c);
        if !is_copied || !is_right(black_box(&filled), length, |_| 0x5a) {
            mark(length as u8);
        }
    }
    mark(0x55);
}

kernel::main!(|boot| {
    let Some(_board) = Board::take(boot) else { return };
    start(TASK.start(boot, Priority::P3, |_| {
        exercise();
        finish()
    }));
});
