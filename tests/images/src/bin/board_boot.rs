//! The data that the board collects at a boot.
//!
//! Marks: the nonce, low byte first; then 1 after power-up, 2 after a watchdog reset, 4 after another; then 3
//! if the board can't be taken twice.
#![no_std]
#![no_main]

use board::Board;
use board::debug::mark;
use tests_images::finish;

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    let [low, high] = board.nonce.to_le_bytes();
    mark(low);
    mark(high);
    if board.reset_cause.is_watchdog() {
        mark(2);
    } else if board.reset_cause.is_power_on() {
        mark(1);
    } else {
        mark(4);
    }
    if Board::take(boot).is_none() {
        mark(3);
    }
    finish()
});
