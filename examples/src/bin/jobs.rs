//! Jobs run to completion, many on one stack: for the small things of which a program has dozens.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::Board;
use board::debug::halt;
use examples::{println, start};
use kernel::{Job, JobContext, JobTaken, Priority, Semaphore, Stack, Timer, now};

board::interrupts!(Interrupts: Tick);

/// Each signal is one run; the first is there at the start.
static BLINK_DUE: Semaphore = Semaphore::new(1);
static BLINK_TIMER: Timer = Timer::new();
static BLINK: Job = Job::new(&BLINK_DUE, blink);

fn blink(job: &mut JobContext) {
    println!("{} ms: blink", now(job));
    BLINK_TIMER.start(job, 4, &BLINK_DUE);
}

static MEASURE_DUE: Semaphore = Semaphore::new(1);
static MEASURE_TIMER: Timer = Timer::new();
static MEASURE: Job = Job::new(&MEASURE_DUE, measure);

fn measure(job: &mut JobContext) {
    println!("{} ms: measure", now(job));
    MEASURE_TIMER.start(job, 6, &MEASURE_DUE);
    if now(job) >= 12 {
        halt()
    }
}

static RUNNER: Stack<160> = Stack::new();

kernel::main!(|boot| {
    let Some(board) = Board::take(boot) else { return };
    board.tick.start(Interrupts);
    start(RUNNER.start(boot, Priority::P3, |task| match task.run_jobs(&[&BLINK, &MEASURE]) {
        Ok(never) => never,
        Err(JobTaken) => {
            println!("a job is twice in the list");
            halt()
        }
    }));
});
