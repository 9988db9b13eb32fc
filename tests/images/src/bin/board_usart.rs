//! Each USART receives its own frames: its transmitter must be wired to its receiver.
//!
//! Marks, for USART0 and then with 0x80 added for USART1: the length of each frame that came whole; 0x40 when
//! the overrun of the frame that is too long for the receiver's buffer was counted; 0x41 when a stream came
//! through embedded-io; 0x7f for anything wrong.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

use board::debug::mark;
use board::serial::{Receiver, Transmitter};
use embedded_io::{Read, Write};
use kernel::{Priority, Semaphore, Stack, Task};
use tasks::device::{Receive, Transmit};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, Usart0, Usart1);

const TOO_LONG: u8 = 0x40;
const STREAM: u8 = 0x41;
const WRONG: u8 = 0x7f;

/// Lengths of the frames in bytes, zeros included. Some are longer than the inbox, one is longer than the
/// receiver's buffer.
const SENT: [usize; 5] = [20, 1, 40, 60, 3];
const RECEIVED: [usize; 4] = [20, 1, 40, 3];

/// The bytes that go through embedded-io. No zero at the end wakes the receiver.
const STREAMED: [u8; 3] = [7, 0, 9];

static SENDER: Stack<240> = Stack::new();
static RECEIVER: Stack<240> = Stack::new();
static IS_HEARD: Semaphore = Semaphore::new(0);

/// Bytes that count up from 1, and a zero at the end.
fn fill(frame: &mut [u8]) {
    for (byte, value) in frame.iter_mut().zip(1..) {
        *byte = value;
    }
    if let Some(last) = frame.last_mut() {
        *last = 0;
    }
}

fn send(mut transmitter: Transmitter, task: &mut Task) {
    let mut frame = [0; 60];
    for length in SENT {
        if let Some(frame) = frame.get_mut(..length) {
            fill(frame);
            transmitter.transmit(task, frame);
        }
    }
    IS_HEARD.wait(task);
    if transmitter.with(task).write_all(&STREAMED).is_err() {
        mark(WRONG);
    }
    IS_HEARD.wait(task);
}

fn receive(mut receiver: Receiver, task: &mut Task, base: u8) {
    let mut expected = [0; 40];
    let mut frame = [0; 40];
    for length in RECEIVED {
        let received = receiver.wait(task, &mut frame);
        let is_right = expected.get_mut(..length).is_some_and(|expected| {
            fill(expected);
            frame.get(..received) == Some(expected)
        });
        mark(base | if is_right { received as u8 } else { WRONG });
    }
    mark(base | if receiver.overruns(task) == 1 { TOO_LONG } else { WRONG });
    IS_HEARD.post(task);
    let mut stream = receiver.with(task);
    let is_right = STREAMED.iter().all(|expected| {
        let mut byte = [0];
        stream.read(&mut byte) == Ok(1) && byte == [*expected]
    });
    mark(base | if is_right { STREAM } else { WRONG });
    IS_HEARD.post(task);
}

kernel::main!(|boot| {
    let Some(board) = board::Board::take(boot) else { return };
    board.tick.start(Interrupts); // a receiver waits for a tick at times
    let (transmitter0, receiver0) = board.usart0.start(Interrupts);
    let (transmitter1, receiver1) = board.usart1.start(Interrupts);
    start(SENDER.start(boot, Priority::P3, |task| {
        send(transmitter0, task);
        send(transmitter1, task);
        finish()
    }));
    start(RECEIVER.start(boot, Priority::P2, |task| {
        receive(receiver0, task, 0);
        receive(receiver1, task, 0x80);
        finish()
    }));
});
