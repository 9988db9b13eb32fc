#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(target_arch = "avr", feature(asm_experimental_arch))]

#[cfg(not(target_arch = "avr"))]
extern crate std;

#[doc(hidden)]
pub mod arch;
#[cfg(not(target_arch = "avr"))]
pub use arch::host;
mod context;
#[cfg(feature = "cpu-time")]
mod cpu_time;
mod event;
mod fifo;
pub mod flash;
mod group;
mod handle;
mod job;
mod link;
mod list;
mod masked;
pub mod monitor;
mod mutex;
mod paint;
mod pipe;
mod pool;
mod queue;
mod ready;
mod semaphore;
#[cfg(target_arch = "avr")]
mod step;
mod target;
mod task;
#[cfg(feature = "tickless")]
pub mod tickless;
mod timeout;
mod timer;
mod walk;
mod word;

pub use context::{Context, Interrupt, JobContext, Task, ThreadContext};
#[cfg(feature = "cpu-time")]
#[doc(hidden)]
pub use cpu_time::charge_in_turn;
#[cfg(feature = "cpu-time")]
pub use cpu_time::{idle_time, total_time};
pub use event::EventFlags;
pub use fifo::Fifo;
pub use handle::{Refused, TaskHandle, TaskState};
pub use job::{Job, JobTaken};
pub use masked::{Masked, MaskedCell};
pub use mutex::{Guard, Mutex};
pub use pipe::Pipe;
pub use pool::{Exhausted, Message, Pool, Pooled, Slot};
pub use queue::{Full, Queue};
pub use semaphore::Semaphore;
#[cfg(target_arch = "avr")]
#[doc(hidden)]
pub use step::{STEPPED, stepped};
#[cfg(target_arch = "avr")]
pub use task::run;
pub use task::{Boot, Never, Priority, Stack, StartError, running};
pub use timeout::Elapsed;
pub use timer::{LONGEST, Period, TICKS, Ticks, Timer, now};
#[doc(hidden)]
pub use timer::{NEXT, TICKS_LEFT};

/// Everything the kernel keeps, apart from what its users declare. Public for the assembly of vectors only.
#[doc(hidden)]
#[repr(C)]
pub struct Kernel {
    ready: ready::Ready,
    timers: timer::Timers,
    walk: walk::Walk,
}

static IDLE: task::ControlBlock = task::ControlBlock::idle();
static SCHEDULER: task::ControlBlock = task::ControlBlock::scheduler();

#[doc(hidden)]
pub static KERNEL: Kernel =
    Kernel { ready: ready::Ready::new(&IDLE), timers: timer::Timers::new(), walk: walk::Walk::new() };

#[cfg(doctest)]
#[doc = include_str!("../../docs/kernel.md")]
struct KernelByExample;
