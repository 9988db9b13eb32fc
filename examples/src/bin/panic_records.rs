//! A panic leaves a record in RAM, and resets the MCU; the next start reads it.
#![no_std]
#![no_main]

use board::debug::halt;
use core::hint::black_box;
use examples::{println, start};
use kernel::{Priority, Stack};

static READER: Stack<128> = Stack::new();

kernel::main!(|boot| {
    if let Some(record) = board::panic::take(boot) {
        let is_reader = record.task == &raw const READER as u16;
        println!("a panic in line {}, in the reader: {}", record.line, is_reader);
        halt()
    }
    println!("no panic so far");
    start(READER.start(boot, Priority::P3, |_| {
        let shelf = ["novel", "atlas", "poems"];
        let number = black_box(3); // from outside, say
        println!("the fourth book: {}", shelf[number]);
        halt()
    }));
});
