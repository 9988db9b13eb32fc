//! Timers that are due at adjacent ticks, in an interrupt storm: the harness raises ticks and an external
//! interrupt, whose handler takes varying times, at any instruction.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::hint::black_box;

use board::debug::mark;
use kernel::{Context, Elapsed, Interrupt, MaskedCell, Never, Priority, Semaphore, Stack, Task, Timer, now};
use tests_images::{finish, start};

board::tick_interrupt!();
board::external_interrupt!(interrupt => handle(interrupt));

/// The program has started.
const BOOTED: u8 = 1;
/// All timers of a round have posted, each at its tick or later.
const ROUND: u8 = 2;
/// Something came too early, or a register was lost.
const WRONG: u8 = 0xff;

static ALARMED: Stack<192> = Stack::new();
static WAITING: [Stack<192>; 3] = [const { Stack::new() }; 3];
/// Exactly as many bytes as the task needs, or one less.
static BUSY: Stack<
    {
        let needs = if cfg!(target_feature = "eijmpcall") { 43 } else { 41 };
        if cfg!(feature = "stack-overflow") { needs - 1 } else { needs }
    },
> = Stack::new();

static TIMERS: [Timer; 3] = [const { Timer::new() }; 3];
static DUE: Semaphore = Semaphore::new(0);
static ANSWERS: [Semaphore; 3] = [const { Semaphore::new(0) }; 3];
static RANDOM: MaskedCell<u16> = MaskedCell::new(1);
static HAS_WINDOW: MaskedCell<bool> = MaskedCell::new(false);

kernel::main!(|boot| {
    mark(BOOTED);
    start(ALARMED.start(boot, Priority::P2, arm));
    for ((stack, answer), ticks) in WAITING.iter().zip(&ANSWERS).zip(2..) {
        start(stack.start(boot, Priority::P4, move |task| wait(task, answer, ticks)));
    }
    start(BUSY.start(boot, Priority::P6, |_| add_up()));
});

/// Arms timers for adjacent ticks.
fn arm(task: &mut Task) -> Never {
    loop {
        let begun = now(task);
        for (timer, ticks) in TIMERS.iter().zip(2..) {
            timer.start(task, ticks, &DUE);
        }
        for ticks in 2..5 {
            DUE.wait(task);
            expect(now(task).wrapping_sub(begun) >= ticks);
        }
        mark(ROUND);
    }
}

/// Waits with a timeout. Each task's timeout ends a tick after that of the task before.
fn wait(task: &mut Task, answer: &'static Semaphore, ticks: u16) -> Never {
    loop {
        let begun = now(task);
        if answer.wait_timeout(task, ticks) == Err(Elapsed) {
            expect(now(task).wrapping_sub(begun) >= ticks);
        }
    }
}

/// The handler of the external interrupt: it takes some 2000 cycles at most, opens a window, and sometimes
/// answers a task.
#[inline(never)]
fn handle(interrupt: &mut Interrupt) {
    let has_window = interrupt.mask(|masked| HAS_WINDOW.replace(masked, true));
    if has_window {
        return; // this interrupt came again within its own window, and has none
    }
    let random = interrupt.mask(|masked| {
        let random = next(RANDOM.get(masked));
        RANDOM.set(masked, random);
        random
    });
    for _ in 0..random & 0xff >> (random >> 8 & 7) {
        black_box(());
    }
    // SAFETY: if this interrupt comes again within the window, its handler returns at once.
    unsafe { interrupt.window() };
    interrupt.mask(|masked| HAS_WINDOW.set(masked, false));
    if let Some(answer) = ANSWERS.get(usize::from(random >> 12)) {
        answer.post(interrupt);
    }
}

/// Xorshift with the full period of 65,535 (Marsaglia, "Xorshift RNGs", 2003).
fn next(mut random: u16) -> u16 {
    random ^= random << 7;
    random ^= random >> 9;
    random ^ random << 8
}

/// Computes the same sum again and again.
fn add_up() -> Never {
    let sum = || (0..100u8).fold(0, |sum: u8, value| sum.wrapping_mul(3).wrapping_add(black_box(value)));
    let first = sum();
    loop {
        expect(sum() == first);
    }
}

fn expect(is_right: bool) {
    if !is_right {
        mark(WRONG);
        finish()
    }
}
