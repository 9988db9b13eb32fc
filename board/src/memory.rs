//! The functions that compiled code calls to copy and to fill memory, in place of the general ones of Rust's
//! `compiler_builtins`: those take three times as long, and 16 bytes more of the stack of every task that
//! copies a message.

use core::arch::asm;

/// Copies `count` bytes that do not overlap. 8 cycles a byte and 20 more.
///
/// # Safety
/// As C's `memcpy`.
#[unsafe(no_mangle)]
unsafe extern "C" fn memcpy(to: *mut u8, from: *const u8, count: usize) -> *mut u8 {
    let [low, high] = count.to_le_bytes();
    // SAFETY: the caller guarantees that both have `count` bytes.
    unsafe {
        asm!(
            "rjmp 3f",
            "2: ld {byte}, Z+", // 2
            "st X+, {byte}",    // 2
            "3: subi {low}, 1", // 1
            "sbci {high}, 0",   // 1
            "brcc 2b",          // 2, at the end 1
            byte = out(reg) _,
            low = inout(reg_upper) low => _,
            high = inout(reg_upper) high => _,
            inout("X") to => _,
            inout("Z") from => _,
            options(nostack),
        );
    }
    to
}

/// Sets `count` bytes to the low byte of `value`. 6 cycles a byte and 20 more.
///
/// # Safety
/// As C's `memset`.
#[unsafe(no_mangle)]
unsafe extern "C" fn memset(to: *mut u8, value: i16, count: usize) -> *mut u8 {
    let [low, high] = count.to_le_bytes();
    // SAFETY: the caller guarantees that `to` has `count` bytes.
    unsafe {
        asm!(
            "rjmp 3f",
            "2: st X+, {value}",  // 2
            "3: subi {low}, 1", // 1
            "sbci {high}, 0",   // 1
            "brcc 2b",          // 2, at the end 1
            value = in(reg) value as u8,
            low = inout(reg_upper) low => _,
            high = inout(reg_upper) high => _,
            inout("X") to => _,
            options(nostack),
        );
    }
    to
}
