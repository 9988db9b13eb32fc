//! The side of the master where both sides send over the bridge; see `bench_bridge/sides.rs`.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

#[path = "bench_bridge/sides.rs"]
mod sides;

use tasks::router::Mcu;

board::interrupts!(Interrupts: Tick, Twi);

const DOES: sides::Does = sides::Does { sends: true, counts: true };

kernel::main!(|boot| sides::begin(boot, Interrupts, Mcu::Master, DOES));
