//! The tasks that `./x bench concurrency` adds. They are in no image that a module is flashed with.

use board::debug::mark;
use board::delay;
use board::external::External;
use board::interrupts::Serves;
use kernel::{Boot, Context, Never, Period, Priority, Semaphore, Stack, Task, Ticks};
use trial::{COMPUTES_EVERY, ELEVEN, PIECE, SEVEN, TRIAL_LENGTH, compute};

/// Posted at each edge.
static EDGE: Semaphore = Semaphore::new(0);

mod stack {
    use super::Stack;

    pub static SEVEN: Stack<96> = Stack::new();
    pub static ELEVEN: Stack<96> = Stack::new();
    pub static EDGE: Stack<66> = Stack::new();
    pub static COMPUTE: Stack<99> = Stack::new();
}

/// Starts the tasks.
pub fn start(boot: &mut Boot, external: External, vectors: impl Serves<External>) -> Option<()> {
    external.start(vectors, boot.interrupt(), &EDGE);
    stack::SEVEN.start(boot, Priority::P5, |task| every(task, SEVEN, trial::mark::SEVEN)).ok()?;
    stack::ELEVEN.start(boot, Priority::P5, |task| every(task, ELEVEN, trial::mark::ELEVEN)).ok()?;
    stack::EDGE
        .start(boot, Priority::P5, |task| -> Never {
            loop {
                EDGE.wait(task);
                mark(trial::mark::EDGE);
            }
        })
        .ok()?;
    stack::COMPUTE
        .start(boot, Priority::P7, |task| -> Never {
            let mut period = Period::new(task, COMPUTES_EVERY);
            loop {
                period.wait(task);
                let length = task.mask(|masked| TRIAL_LENGTH.get(masked));
                mark(trial::mark::BEGINS);
                compute(length, delay::cycles::<PIECE>);
                mark(trial::mark::ENDS);
            }
        })
        .ok()
}

fn every(task: &mut Task, ticks: Ticks, value: u8) -> Never {
    let mut period = Period::new(task, ticks);
    loop {
        period.wait(task);
        mark(value);
    }
}
