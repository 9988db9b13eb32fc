//! The six categories of AvrX's calls, with each corresponding call of ours once: the calls of `bench_flash`,
//! and control of tasks, single steps, byte FIFOs, the EEPROM.
//!
//! `black_box` hides the objects of the calls, so that these are compiled for any object.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;
use tests_images as _; // the panic handler

use board::Board;
use board::eeprom::Storage;
use board::trap::Stepper;
use kernel::{Fifo, Message, Never, Period, Pipe, Priority, Queue, Semaphore, Stack, Task, Timer};

board::interrupts!(Interrupts: Tick, Eeprom, Trap);

struct Reading(#[expect(dead_code, reason = "only its way is looked at")] u8);
kernel::pool!(Reading, 2);

struct Objects {
    semaphore: Semaphore,
    timer: Timer,
    queue: Queue<Reading>,
    fifo: Fifo<8>,
    pipe: Pipe<8>,
}

static TASK: Stack<192> = Stack::new();
static OTHER: Stack<192> = Stack::new();
static OBJECTS: Objects = Objects {
    semaphore: Semaphore::new(0),
    timer: Timer::new(),
    queue: Queue::new(2),
    fifo: Fifo::new(),
    pipe: Pipe::new(),
};

kernel::interrupt! {
    fn __vector_5(interrupt) { OBJECTS.semaphore.post(interrupt); }
}

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    let storage = board.eeprom.start(Interrupts);
    let stepper = board.trap.start(Interrupts);
    let _ = black_box(&TASK).start(boot, Priority::P3, move |task| body(task, storage, stepper));
    let _ = black_box(&OTHER).start(boot, Priority::P4, |task| task.exit());
});

fn body(task: &mut Task, storage: Storage, mut stepper: Stepper) -> Never {
    let Objects { semaphore, timer, queue, fifo, pipe } = black_box(&OBJECTS);
    let mut period = Period::new(task, 10);
    loop {
        semaphore.wait(task);
        semaphore.post(task);
        if !semaphore.try_wait(task) {
            task.yield_now();
        }
        timer.start(task, 5, semaphore);
        if !timer.cancel(task) {
            task.delay(2);
        }
        if let Ok(message) = Message::new(task, Reading(1)) {
            let _ = queue.send(task, message);
        }
        drop(queue.try_receive(task));
        drop(queue.receive(task));
        period.wait(task);

        let other = black_box(OTHER.task());
        let _ = other.suspend(task);
        let _ = stepper.step(task, other);
        let _ = other.set_priority(task, Priority::P5);
        other.resume(task);
        let _ = black_box(other.state(task));
        let _ = other.kill(task);

        if fifo.put(task, 1).is_none() {
            let _ = black_box(fifo.peek(task));
            let _ = black_box(fifo.take(task));
            fifo.flush(task);
        }
        pipe.put(task, 2);
        let _ = black_box(pipe.take(task));

        let mut byte = [0];
        let _ = storage.read(task, black_box(0), &mut byte);
        let _ = storage.write(task, black_box(0), &byte);
    }
}
