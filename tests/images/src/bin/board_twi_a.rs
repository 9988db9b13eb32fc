//! Sends packets to the other MCU while that does the same; see `board_twi_b`.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

#[path = "board_twi/exchange.rs"]
mod exchange;

use board::Board;
use board::superbot::{MASTER, SLAVE};

board::interrupts!(Interrupts: Tick, Twi);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    exchange::begin(boot, Interrupts, board.tick, board.twi, MASTER.address, SLAVE.address);
});
