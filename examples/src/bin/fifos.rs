//! A FIFO takes bytes from an interrupt to a task, which is woken once a line.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::halt;
use examples::{println, start, timer2};
use kernel::{Context, Fifo, Interrupt, MaskedCell, Priority, Semaphore, Stack};

static RECEIVED: Fifo<16> = Fifo::new();
static LINE_ENDED: Semaphore = Semaphore::new(0);
static READER: Stack<160> = Stack::new();

kernel::interrupt! {
    fn __vector_9(interrupt) {
        if let Some(byte) = next_on_the_wire(interrupt) {
            let space = RECEIVED.put(interrupt, byte); // `None`: no space, and the byte is counted as lost
            if byte == b'\n' || space == Some(0) {
                LINE_ENDED.post(interrupt);
            }
        }
    }
}

kernel::main!(|boot| {
    start(READER.start(boot, Priority::P3, |task| {
        for _ in 0..2 {
            LINE_ENDED.wait(task);
            let mut sum = 0u16;
            while let Some(digit @ b'0'..=b'9') = RECEIVED.take(task) {
                sum = sum * 10 + u16::from(digit - b'0');
            }
            println!("a number: {}", sum);
        }
        println!("lost: {}", RECEIVED.overruns(task));
        halt()
    }));
    timer2::start();
});

/// In place of a serial port.
fn next_on_the_wire(interrupt: &mut Interrupt) -> Option<u8> {
    static NEXT: MaskedCell<u8> = MaskedCell::new(0);
    interrupt.mask(|masked| {
        let next = NEXT.get(masked);
        NEXT.set(masked, next.wrapping_add(1));
        b"1024\n65535\n".get(usize::from(next)).copied()
    })
}
