//! Uses `board_i2c_device` while it exchanges packets with the other MCU, which does the same; see
//! `board_i2c_crowd_a`. Three nodes share the bus.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

#[path = "board_i2c/crowd.rs"]
mod crowd;
#[path = "board_twi/exchange.rs"]
mod exchange;

use board::Board;
use board::superbot::{MASTER, SLAVE};

board::interrupts!(Interrupts: Tick, I2c);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    exchange::begin(boot, Interrupts, board.tick, board.twi, SLAVE.address, MASTER.address);
    crowd::begin(boot, Interrupts, board.i2c, 8);
});
