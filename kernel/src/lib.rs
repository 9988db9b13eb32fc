#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(target_arch = "avr", feature(asm_experimental_arch))]

#[doc(hidden)]
pub mod arch;
mod context;
mod control;
mod control_block;
#[cfg(feature = "cpu-time")]
mod cpu_time;
mod critical;
mod event;
mod fifo;
pub mod flash;
mod job;
mod link;
pub mod monitor;
mod mutex;
mod pipe;
mod pool;
mod proxy;
mod queue;
mod ready;
mod semaphore;
mod stack_watermark;
mod step;
mod task;
#[cfg(any(feature = "tickless", test))]
pub mod tickless;
mod timer;
mod traversal;
mod wait;
mod wait_set;
mod word;

#[allow(unused_imports, reason = "a port may offer nothing")]
pub use arch::public::*;
pub use context::{Boot, Context, Interrupt, JobContext, Never, Task, ThreadContext};
pub use control::{Refused, TaskHandle, TaskState};
pub use control_block::Priority;
#[cfg(feature = "cpu-time")]
#[doc(hidden)]
pub use cpu_time::charge_in_turn;
#[cfg(feature = "cpu-time")]
pub use cpu_time::{idle_time, total_time};
pub use critical::{KernelCell, Masked, MaskedCell};
pub use event::EventFlags;
pub use fifo::Fifo;
pub use job::{Job, JobTaken};
pub use mutex::{Guard, Mutex};
pub use pipe::Pipe;
pub use pool::{Exhausted, Message, Pool, Pooled, Slot};
pub use proxy::Elapsed;
pub use queue::{Full, Queue};
pub use semaphore::Semaphore;
#[doc(hidden)]
pub use step::{GOES_ON, STEPPED, stepped};
#[doc(hidden)]
pub use task::init;
pub use task::{Stack, StartError, run, running};
pub use timer::{LONGEST, Period, TICKS, Ticks, Timer, is_reached, now};
#[doc(hidden)]
pub use timer::{NEXT_DEADLINE, count_tick, expire};

/// The kernel's own state; what a program declares itself, such as tasks, is not in here. Public only for the
/// assembly of vectors.
#[doc(hidden)]
#[repr(C)]
pub struct Kernel {
    ready: ready::ReadyQueue,
    timers: timer::Timers,
    traversal: traversal::Traversal,
}

/// The idle task, which runs when no other task is ready.
static IDLE: control_block::ControlBlock = control_block::ControlBlock::idle(arch::IDLE_CONTEXT);

#[doc(hidden)]
pub static KERNEL: Kernel = Kernel {
    ready: ready::ReadyQueue::new(&IDLE),
    timers: timer::Timers::new(),
    traversal: traversal::Traversal::new(),
};

#[cfg(doctest)]
#[doc = include_str!("../../docs/kernel.md")]
struct KernelByExample;
