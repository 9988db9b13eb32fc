//! A task makes single steps, while ticks, a button and tasks of higher priority continue.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::debug::mark;
use board::trap::Stepper;
use kernel::{Context, MaskedCell, Mutex, Period, Priority, Refused, Semaphore, Stack, Task, TaskState};
use tests_images::{finish, start};

board::interrupts!(Interrupts: Tick, External, Trap);

/// The worker begins a round.
const ROUND: u8 = 1;
/// The worker is suspended, and has made another step.
const STEPPED: u8 = 2;
/// The worker runs by itself.
const RESUMED: u8 = 3;
/// The mark of the highest task, at each tick.
const TICK: u8 = 4;
/// The mark of a task of high priority, at each press of the button.
const PRESSED: u8 = 5;
/// The walker has passed its yield, its semaphore, its mutex and its post, and has ended.
const YIELDED: u8 = 0x10;
const PASSED: u8 = 0x11;
const UNLOCKED: u8 = 0x12;
const POSTED: u8 = 0x13;
const ENDED: u8 = 0x14;
/// The walker waits.
const WAITS: u8 = 0x15;
/// The mark of a task that the walker has woken.
const WOKEN: u8 = 0x16;
const WRONG: u8 = 0xff;

const STEPS: u16 = 300;

static TICKED: Stack<128> = Stack::new();
static PRESSEE: Stack<128> = Stack::new();
static DIRECTOR: Stack<224> = Stack::new();
static WOKEN_ONE: Stack<128> = Stack::new();
/// The test reads this task's context.
#[unsafe(no_mangle)]
static WORKER: Stack<192> = Stack::new();
static WALKER: Stack<192> = Stack::new();
static EQUAL: Stack<96> = Stack::new();

static BUTTON: Semaphore = Semaphore::new(0);
static GATE: Semaphore = Semaphore::new(0);
static WAKE: Semaphore = Semaphore::new(0);
static TOTAL: Mutex<u16> = Mutex::new(Priority::P4, 0);
static ROUNDS: MaskedCell<u16> = MaskedCell::new(0);

kernel::main!(|boot| {
    let Some(board) = board::Board::take(boot) else { return };
    board.tick.start(Interrupts);
    board.external.start(Interrupts, boot, &BUTTON);
    let mut stepper = board.trap.start(Interrupts);
    start(TICKED.start(boot, Priority::P0, |task| {
        let mut period = Period::new(task, 1);
        loop {
            period.wait(task);
            mark(TICK);
        }
    }));
    start(PRESSEE.start(boot, Priority::P1, |task| {
        loop {
            BUTTON.wait(task);
            mark(PRESSED);
        }
    }));
    start(DIRECTOR.start(boot, Priority::P3, move |task| {
        step_worker(task, &mut stepper);
        step_walker(task, &mut stepper);
        finish()
    }));
    start(WOKEN_ONE.start(boot, Priority::P2, |task| {
        loop {
            WAKE.wait(task);
            mark(WOKEN);
        }
    }));
    start(WORKER.start(boot, Priority::P5, |task| {
        loop {
            mark(ROUND);
            if mixture() != MIXTURE {
                mark(WRONG);
            }
            // A critical section here, and one in a call.
            task.mask(|masked| ROUNDS.count(masked));
            GATE.try_wait(task);
        }
    }));
});

/// Steps a task that was preempted at any place.
fn step_worker(task: &mut Task, stepper: &mut Stepper) {
    let worker = WORKER.task();
    expect(stepper.step(task, worker) == Err(Refused::Busy));
    expect(stepper.step(task, WALKER.task()) == Err(Refused::NotStarted));
    task.delay(2);
    expect(worker.suspend(task).is_ok());
    for _ in 0..STEPS {
        expect(stepper.step(task, worker).is_ok());
        mark(STEPPED);
    }
    expect(worker.state(task) == TaskState::Suspended);
    expect(worker.priority(task) == Priority::P5);
    expect(worker.resume(task));
    mark(RESUMED);
    task.delay(2);
    expect(worker.suspend(task).is_ok());
}

/// Steps a task through calls of the kernel.
fn step_walker(task: &mut Task, stepper: &mut Stepper) {
    start(WALKER.start(task, Priority::P6, |task| {
        task.yield_now();
        mark(YIELDED);
        GATE.wait(task);
        mark(PASSED);
        TOTAL.with(task, |total| *total += 1);
        mark(UNLOCKED);
        WAKE.post(task);
        mark(POSTED);
    }));
    start(EQUAL.start(task, Priority::P6, |task| {
        loop {
            task.yield_now();
        }
    }));
    let walker = WALKER.task();
    expect(walker.suspend(task).is_ok());
    while GATE.try_wait(task) {}
    while stepper.step(task, walker).is_ok() {}
    mark(WAITS);
    expect(walker.state(task) == TaskState::Suspended);
    expect(!GATE.try_wait(task));
    GATE.post(task);
    while stepper.step(task, walker).is_ok() {}
    expect(walker.state(task) == TaskState::NotStarted);
    expect(TOTAL.with(task, |total| *total) == 1);
    mark(ENDED);
}

fn expect(is_so: bool) {
    if !is_so {
        mark(WRONG);
    }
}

/// The value of [`mixture`] if no register is lost.
const MIXTURE: u32 = mix([3, 5, 7, 11, 13, 17]);

#[inline(always)]
fn mixture() -> u32 {
    mix(black_box([3, 5, 7, 11, 13, 17]))
}

/// Keeps 24 bytes alive in registers.
#[inline(always)]
const fn mix([mut a, mut b, mut c, mut d, mut e, mut f]: [u32; 6]) -> u32 {
    a = a.wrapping_add(f);
    b ^= a;
    c = c.wrapping_sub(b);
    d = d.wrapping_add(c ^ e);
    e = e.wrapping_sub(d);
    f ^= e;
    a ^ b ^ c ^ d ^ e ^ f
}
