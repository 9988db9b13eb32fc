//! The receiving side of the link test; see `bench_link/sides.rs`.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

#[path = "bench_link/sides.rs"]
mod sides;

board::interrupts!(Interrupts: Tick, Usart0);

kernel::main!(|boot| sides::begin(boot, Interrupts, false));
