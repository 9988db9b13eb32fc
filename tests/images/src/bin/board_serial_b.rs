//! The same as `board_serial_a`, on the slave.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

#[path = "board_serial/load.rs"]
mod load;

use board::superbot::{MASTER, SLAVE};

board::interrupts!(Interrupts: Tick, Usart0, Usart1, SoftUart, Twi, Adc);

kernel::main!(|boot| load::begin(boot, Interrupts, &SLAVE, &MASTER));
