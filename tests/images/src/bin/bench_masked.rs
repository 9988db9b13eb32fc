//! The kernel's calls where they are slowest: many timers, many that are due at once, many tasks that wait
//! for one thing.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use kernel::{Message, Mutex, Never, Priority, Queue, Semaphore, Stack, Task, Timer};
use tests_images::bench::busy;
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick);

struct Reading(#[expect(dead_code, reason = "only its way is looked at")] u8);
kernel::pool!(Reading, 4);

static WAITING: [Stack<96>; 6] = [const { Stack::new() }; 6];
static RECEIVING: [Stack<96>; 4] = [const { Stack::new() }; 4];
static DELAYED: [Stack<112>; 4] = [const { Stack::new() }; 4];
static LOW: Stack<160> = Stack::new();
static TIMERS: [Timer; 50] = [const { Timer::new() }; 50];
static GATE: Semaphore = Semaphore::new(0);
static STORE: Semaphore = Semaphore::new(0);
static QUEUE: Queue<Reading> = Queue::new(4);
static TOTAL: Mutex<u16> = Mutex::new(Priority::P0, 0);

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    for stack in &WAITING {
        start(stack.start(boot, Priority::P2, |task| {
            loop {
                GATE.wait(task);
            }
        }));
    }
    for stack in &RECEIVING {
        start(stack.start(boot, Priority::P2, |task| {
            loop {
                drop(QUEUE.receive(task));
            }
        }));
    }
    for stack in &DELAYED {
        start(stack.start(boot, Priority::P1, |task| {
            loop {
                task.delay(2);
                TOTAL.with(task, |total| *total += 1);
            }
        }));
    }
    start(LOW.start(boot, Priority::P6, low));
});

fn low(task: &mut Task) -> Never {
    for round in 0..4 {
        // Each timer is due after the ones before, but the last ten are due at once.
        for (timer, place) in TIMERS.iter().zip(0..) {
            timer.start(
                task,
                20 + if place < 40 { place } else { 40 },
                if place < 40 { &STORE } else { &GATE },
            );
        }
        for timer in TIMERS.iter().rev().take(5) {
            timer.cancel(task);
            timer.start(task, 60, &GATE);
        }
        for timer in &TIMERS {
            timer.start(task, 60, &GATE); // restarted, to the last place
        }
        for timer in TIMERS.iter().skip(10) {
            timer.cancel(task);
        }
        for _ in 0..8 {
            GATE.post(task);
            STORE.post(task);
            while STORE.try_wait(task) {}
            if let Ok(message) = Message::new(task, Reading(round)) {
                let _ = QUEUE.send(task, message);
            }
            TOTAL.with(task, |total| *total = total.wrapping_add(3));
            task.yield_now();
            busy();
        }
        task.delay(70);
    }
    finish()
}
