//! The kernel's objects, made from the harness's arrangement.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use kernel::{Boot, JobContext, Semaphore, Stack, TaskHandle};
use model::world::{self, Arrangement, JOBS_IN_ALL, SEMAPHORES, World};

/// The number of tasks; an MCU with little RAM has fewer.
pub const TASKS: usize = if cfg!(feature = "atmega328p") { 4 } else { model::world::TASKS };

/// Bytes of a task's stack.
const STACK: usize = 336;

/// The harness finds the stacks by this name.
#[unsafe(no_mangle)]
pub static MODEL_STACKS: [Stack<STACK>; TASKS] = [const { Stack::new() }; TASKS];
pub use MODEL_STACKS as STACKS;

/// A place for a value that is made before the first task runs, and not changed after.
struct Place<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: `arrange` alone writes, before there are tasks and with interrupts masked.
unsafe impl<T> Sync for Place<T> {}

static PRIORITIES: Place<[u8; world::TASKS]> = Place(UnsafeCell::new(MaybeUninit::uninit()));
static SEMAPHORES_MADE: Place<[Semaphore; SEMAPHORES]> = Place(UnsafeCell::new(MaybeUninit::uninit()));
static HANDLES: Place<[TaskHandle; TASKS]> = Place(UnsafeCell::new(MaybeUninit::uninit()));
static WORLD: Place<World> = Place(UnsafeCell::new(MaybeUninit::uninit()));

impl<T> Place<T> {
    /// Fills the place.
    fn fill(&'static self, _: &mut Boot, value: T) -> &'static T {
        // SAFETY: `Boot` is there before any task, with interrupts masked, and `arrange` runs once.
        unsafe { (*self.0.get()).write(value) }
    }

    fn get(&'static self) -> &'static T {
        // SAFETY: `arrange` fills all places before any task starts or interrupts are enabled.
        unsafe { (*self.0.get()).assume_init_ref() }
    }
}

/// Makes the objects. Called once, before anything else.
#[inline(never)]
pub fn arrange(boot: &mut Boot, arrangement: &Arrangement, bodies: [fn(&mut JobContext); JOBS_IN_ALL]) {
    PRIORITIES.fill(boot, arrangement.priorities);
    let semaphores = SEMAPHORES_MADE.fill(boot, World::semaphores(arrangement));
    let tasks = HANDLES.fill(boot, STACKS.each_ref().map(Stack::task));
    WORLD.fill(boot, World::new(arrangement, tasks, semaphores, bodies));
}

/// The priority with which a task starts.
pub fn priority_of(task: usize) -> u8 {
    PRIORITIES.get()[task]
}

pub fn world() -> &'static World {
    WORLD.get()
}
