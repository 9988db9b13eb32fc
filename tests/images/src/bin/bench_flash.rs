//! The kernel with every call on tasks, semaphores, timers and queues once, and little else.
//!
//! `black_box` hides the objects of the calls, so that these are compiled for any object.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;
use tests_images as _; // the panic handler

use kernel::{Message, Never, Period, Priority, Queue, Semaphore, Stack, Task, Timer};

struct Reading(#[expect(dead_code, reason = "only its way is looked at")] u8);
kernel::pool!(Reading, 2);

struct Objects {
    semaphore: Semaphore,
    timer: Timer,
    queue: Queue<Reading>,
}

static TASK: Stack<128> = Stack::new();
static OBJECTS: Objects = Objects { semaphore: Semaphore::new(0), timer: Timer::new(), queue: Queue::new(2) };

kernel::tick_interrupt!(__vector_15);
kernel::interrupt! {
    fn __vector_5(interrupt) { OBJECTS.semaphore.post(interrupt); }
}

kernel::main!(|boot| {
    let _ = black_box(&TASK).start(boot, Priority::P3, body);
});

fn body(task: &mut Task) -> Never {
    let Objects { semaphore, timer, queue } = black_box(&OBJECTS);
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
    }
}
