//! Single steps: a suspended task runs for one instruction.
//!
//! The AVR runs one instruction after `reti` before it takes the next interrupt (ATmega128 datasheet, "Reset
//! and Interrupt Handling"). So a step makes the task the head and arms the *trap*, an interrupt that stays
//! pending. When the trap finds another task running, it returns: the kernel advances by one instruction at a
//! time. When it first finds the task, it returns, too, and the task runs one instruction; the next time, the
//! step is complete. It lets the task run once because the kernel returns to a task by `sei` and `ret`, after
//! which an interrupt occurs at once.
//!
//! The trap has priority over all other interrupts. An interrupt that occurred before it would return to the
//! task, and let it run another instruction.
//!
//! During its step the task is alone in the highest queue of ready tasks; therefore a task of priority P0
//! can't step others. So whatever it does, it stays the head, or blocks. On the host there is no trap: the
//! task runs until it blocks, keeps P0, and is not suspended any more.

use crate::arch;
use crate::context::{Context, Interrupt, Task};
use crate::control::{Refused, TaskHandle};
use crate::control_block::{ControlBlock, Flag, Priority};
use crate::critical::{KernelCell, Masked, MaskedCell};
use crate::link::Link;
use crate::ready;
use crate::traversal;

/// The task that the trap waits for. Public for the assembly of its vector only.
#[doc(hidden)]
pub static STEPPED: KernelCell<Option<&'static ControlBlock>> = KernelCell::new(None);

/// Not 0 while the task runs its instruction; 0 while the trap is disabled, which only its handler does.
/// Public for the same reason.
#[doc(hidden)]
pub static GOES_ON: KernelCell<u8> = KernelCell::new(0);

/// The priority that the stepped task gets back after its step.
static PRIORITY: MaskedCell<Option<Priority>> = MaskedCell::new(None);

impl TaskHandle {
    /// Runs one instruction of the task, which must be suspended and must not wait. `arm` arms the trap: from
    /// then on the interrupt declared by `trap_interrupt!` is pending, and no other has priority over it.
    ///
    /// A critical section counts as one instruction, and so does all that the task does while it holds a
    /// mutex or looks for a place in a list. The first step of a task that blocked or yielded only takes it
    /// to where the kernel returns to it. A task that blocks in a step goes before the others that wait for
    /// the same object, and so do, for good, the jobs that it has begun to wait for. A task that has to wait
    /// for a mutex, ends, or changes its own priority is not suspended any more; it gets that mutex at its
    /// own priority, not at the ceiling. A task that makes itself P0 keeps the priority that it had.
    ///
    /// Other tasks and interrupts wait until the step is complete, some 2500 cycles: the kernel's path to the
    /// task runs by one instruction at a time.
    ///
    /// # Errors
    /// [`Refused::NotStarted`]; [`Refused::Busy`] unless the task is suspended and waits for nothing, and if
    /// the caller has priority P0.
    pub fn step(self, task: &mut Task, arm: impl FnOnce(&Masked)) -> Result<(), Refused> {
        task.mask(|masked| {
            let control = self.control;
            if !control.is_started(masked) || control.has_flag(masked, Flag::Killed) {
                return Err(Refused::NotStarted);
            }
            let is_parked = control.is_halted(masked) && control.link.get(masked) == Link::PARKED;
            if !is_parked || ready::running(masked).queue(masked) == 0 {
                return Err(Refused::Busy);
            }
            PRIORITY.set(masked, Some(control.priority(masked)));
            control.level.set(masked, 0);
            control.set_priority(masked, Priority::P0);
            traversal::end(masked); // the task may be in the middle of an older one
            ready::wake(masked, control);
            STEPPED.set(masked, Some(control));
            arm(masked);
            Ok(())
        })?;
        arch::switch_from_call(task);
        task.mask(|masked| {
            // The trap never finds a task that has ended: let it find this one.
            PRIORITY.set(masked, None);
            STEPPED.set(masked, Some(ready::running(masked)));
        });
        arch::switch_from_call(task);
        Ok(())
    }
}

/// Called when the trap has found the task, which is the running one. Returns whether the step is complete,
/// and the trap must be disabled.
///
/// # Safety
/// Only for the vector of the trap, which has found that task. During a step this suspends the running task,
/// whichever it is.
///
/// ```compile_fail,E0133
/// # use kernel::Interrupt;
/// fn handler(interrupt: &mut Interrupt) {
///     kernel::stepped(interrupt); // error: call to unsafe function requires an unsafe block
/// }
/// ```
#[doc(hidden)]
pub unsafe fn stepped(interrupt: &mut Interrupt) -> bool {
    interrupt.mask(|masked| {
        let Some(priority) = PRIORITY.get(masked) else { return true };
        let control = ready::running(masked);
        let is_ready = ready::is_first(masked, control);
        let locks = control.has_flag(masked, Flag::Locks);
        // A traversal that is broken off here would restart in each further step.
        if is_ready && (locks || traversal::is_valid(masked)) {
            return false;
        }
        PRIORITY.set(masked, None);
        if control.queue(masked) != 0 {
            return true; // it has changed its priority
        }
        if is_ready {
            ready::leave(masked).link.set(masked, Link::PARKED);
        }
        control.set_priority(masked, priority);
        // If it waits for a mutex, the holder that hands it over must find a task that is not halted.
        if !locks {
            control.halt(masked);
        }
        ready::update_head(masked);
        true
    })
}
