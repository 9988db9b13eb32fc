//! The kernel with every call on tasks, semaphores, timers and queues once, and little else.
//!
//! What the calls work on is looked up while the program runs, so that they are built for any object.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use tests_images as _; // the panic handler
use kernel::{Message, Never, Period, Priority, Queue, Semaphore, Stack, Task, Timer};

struct Reading(#[expect(dead_code, reason = "only its way is looked at")] u8);
kernel::pool!(Reading, 2);

struct Objects {
    semaphore: Semaphore,
    timer: Timer,
    queue: Queue<Reading>,
}

static STACKS: [Stack<96>; 2] = [const { Stack::new() }; 2];
static OBJECTS: [Objects; 2] = [const {
    Objects { semaphore: Semaphore::new(0), timer: Timer::new(), queue: Queue::new(2) }
}; 2];
static PRESSED: Semaphore = Semaphore::new(0);

kernel::tick_interrupt!(__vector_15);
kernel::interrupt! {
    fn __vector_5(interrupt) { PRESSED.post(interrupt); }
}

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    kernel::run(|boot| {
        for (stack, objects) in STACKS.iter().zip(&OBJECTS) {
            let _ = stack.start(boot, Priority::P3, move |task| body(task, objects));
        }
    })
}

fn body(task: &mut Task, Objects { semaphore, timer, queue }: &'static Objects) -> Never {
    let mut period = Period::new(task, 10);
    loop {
        PRESSED.wait(task);
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
