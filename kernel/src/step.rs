//! Single steps: a suspended task runs for one instruction.
//!
//! The AVR runs one instruction after `reti` before it takes the next interrupt (ATmega128 datasheet, "Reset and Interrupt
//! Handling"). So the task is made the head, an interrupt that stays pending is let loose, the *trap*, and wherever that finds
//! another than the task at work it returns: the kernel gets on by an instruction at a time. When it finds the task, that has
//! made its step.
//!
//! The trap goes before all other interrupts. One that came first would return to the task, and let it run for another
//! instruction.
//!
//! For the time of its step the task has a priority above all others, P0 with nothing that preempts it. So whatever it does to
//! the lists of ready tasks, it stays the head, or blocks.

use crate::KERNEL;
use crate::arch;
use crate::context::{Context, Interrupt, Task};
use crate::handle::{Refused, TaskHandle};
use crate::link::Link;
use crate::masked::{Masked, MaskedCell};
use crate::ready;
use crate::task::{ControlBlock, Flag, Priority};
use crate::walk;

/// The task that the trap waits for. Public for the assembly of its vector only.
#[doc(hidden)]
pub static STEPPED: MaskedCell<Option<&'static ControlBlock>> = MaskedCell::new(None);

/// The priority to give back to the task that makes a step.
static PRIORITY: MaskedCell<Option<Priority>> = MaskedCell::new(None);

impl TaskHandle {
    /// Runs one instruction of the task, which is suspended and does not wait. `spring` lets the trap loose: from there on the
    /// vector declared by [`trap_interrupt!`](crate::trap_interrupt!) is pending, and no other interrupt goes before it.
    ///
    /// What the task does with interrupts masked counts as one instruction, and so does all that it does while it has a mutex.
    /// The first step of a task that blocked or yielded takes it no further than the kernel's return to it. A task that
    /// blocks in a step stands before the others that wait for the same. One that has to wait for a mutex, ends, or lowers
    /// its own priority is not suspended any more; one that makes itself P0 keeps the priority that it had.
    ///
    /// Other tasks and interrupts wait until the step is made, some 2500 cycles: the way to the task goes by an instruction at
    /// a time.
    ///
    /// # Errors
    /// [`Refused::NotStarted`]; [`Refused::Busy`] unless it is suspended and waits for nothing, and where the caller is of
    /// priority P0: tasks of its own priority would mix with the one that makes a step.
    pub fn step(self, task: &mut Task, spring: impl FnOnce(&Masked)) -> Result<(), Refused> {
        task.mask(|masked| {
            let control = self.control;
            if !control.is_started(masked) {
                return Err(Refused::NotStarted);
            }
            let is_parked = control.is_suspended(masked) && control.link.get(masked) == Link::PARKED;
            if !is_parked
                || control.has_flag(masked, Flag::Held)
                || ready::running(masked).above.get(masked) == 0
            {
                return Err(Refused::Busy);
            }
            PRIORITY.set(masked, Some(control.priority(masked)));
            control.change_priority(masked, Priority::P0);
            control.above.set(masked, 0);
            control.link.set(masked, Link::to(KERNEL.ready.head.get(masked)));
            KERNEL.ready.head.set(masked, control);
            STEPPED.set(masked, Some(control));
            spring(masked);
            Ok(())
        })?;
        arch::switch_from_call();
        task.mask(|masked| {
            // A task that has ended never meets the trap, so this one does.
            PRIORITY.set(masked, None);
            STEPPED.set(masked, Some(ready::running(masked)));
            // After whoever has arrived meanwhile and outranks it.
            ready::put_head(masked, ready::running(masked));
        });
        arch::switch_from_call();
        Ok(())
    }
}

/// The trap has found the task, which is the running one. Returns whether the step is made, and the trap to be disabled.
#[doc(hidden)]
pub fn stepped(interrupt: &mut Interrupt) -> bool {
    interrupt.mask(|masked| {
        let Some(priority) = PRIORITY.get(masked) else { return true };
        let control = ready::running(masked);
        let is_head = KERNEL.ready.head.get(masked).is(control);
        let locks = control.has_flag(masked, Flag::Locks);
        if is_head && locks {
            return false;
        }
        PRIORITY.set(masked, None);
        let is_p0 = control.above.get(masked) == 0;
        // Unless the task has lowered it.
        if is_p0 || control.is_suspended(masked) {
            control.change_priority(masked, priority);
            control.suspend(masked);
        }
        if is_p0 && locks {
            // It waits for a mutex, and whoever hands that over must find it able to run.
            arch::resume(masked, control);
        } else if is_p0 && is_head {
            KERNEL.ready.head.set(masked, control.next_ready(masked));
            control.link.set(masked, Link::PARKED);
            walk::end(masked);
        }
        true
    })
}
