//! Measured: the time that a tick takes from a busy task while timers are pending, and a tick that ends a
//! delay. The program never ends.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use kernel::{Priority, Semaphore, Stack, Timer};
use tests_images::bench::{begin, busy, end};
use tests_images::start;

board::interrupts!(Interrupts: Tick);

const PENDING_0: u8 = 1;
const PENDING_1: u8 = 2;
const PENDING_10: u8 = 3;
const PENDING_50: u8 = 4;
const DELAYED: u8 = 5;
const BY_TIMER: u8 = 6;
const BY_TIMEOUT: u8 = 7;

static HIGH: Stack<128> = Stack::new();
static BUSY: Stack<128> = Stack::new();
static TIMERS: [Timer; 50] = [const { Timer::new() }; 50];
static DUE: Semaphore = Semaphore::new(0);
static ALARM: Timer = Timer::new();
static RUNG: Semaphore = Semaphore::new(0);
static NEVER: Semaphore = Semaphore::new(0);
static BEGIN: Semaphore = Semaphore::new(0);

/// More ticks than any run takes.
const FAR: kernel::Ticks = 10_000;

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(HIGH.start(boot, Priority::P1, |task| {
        BEGIN.wait(task);
        loop {
            task.delay(2);
            end::<DELAYED>();
            ALARM.start(task, 2, &RUNG);
            RUNG.wait(task);
            end::<BY_TIMER>();
            let _ = NEVER.wait_timeout(task, 2);
            end::<BY_TIMEOUT>();
        }
    }));
    start(BUSY.start(boot, Priority::P6, |task| {
        begin::<PENDING_0>();
        busy();
        end::<PENDING_0>();
        arm(task, 0..1);
        begin::<PENDING_1>();
        busy();
        end::<PENDING_1>();
        arm(task, 1..10);
        begin::<PENDING_10>();
        busy();
        end::<PENDING_10>();
        arm(task, 10..50);
        begin::<PENDING_50>();
        busy();
        end::<PENDING_50>();
        BEGIN.post(task);
        loop {
            busy();
        }
    }));
});

fn arm(task: &mut kernel::Task, timers: core::ops::Range<usize>) {
    for timer in TIMERS.iter().take(timers.end).skip(timers.start) {
        timer.start(task, FAR, &DUE);
    }
}
