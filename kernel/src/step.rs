//! Single steps: a suspended task runs for one instruction.
//!
//! The AVR runs one instruction after `reti` before it takes the next interrupt (ATmega128 datasheet, "Reset
//! and Interrupt Handling"). So the task is made the head, an interrupt that stays pending is armed, the
//! *trap*, and wherever that finds another than the task at work it returns: the kernel gets on by an
//! instruction at a time. When it finds the task, it lets that go on by one, too, and then the step is made:
//! the kernel returns to a task by `sei` and `ret`, behind which an interrupt comes at once.
//!
//! The trap goes before all other interrupts. One that came first would return to the task, and let it run
//! for another instruction.
//!
//! For the time of its step the task is alone in the highest queue of ready tasks: a task of priority P0
//! can't step others. So whatever it does, it stays the head, or blocks. On the host no trap comes: the task
//! goes on until it blocks, keeps P0, and is not suspended any more.

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

/// Not 0 while the task makes an instruction; 0 where the trap is disabled, which only its handler does.
/// Public for the same.
#[doc(hidden)]
pub static GOES_ON: KernelCell<u8> = KernelCell::new(0);

/// The priority to give back to the task that makes a step.
static PRIORITY: MaskedCell<Option<Priority>> = MaskedCell::new(None);

impl TaskHandle {
    /// Runs one instruction of the task, which is suspended and does not wait. `arm` arms the trap: from
    /// there on the vector declared by `trap_interrupt!` is pending, and no other interrupt goes before it.
    ///
    /// What the task does with interrupts masked counts as one instruction, and so does all that it does
    /// while it has a mutex, or looks for a place in a list. The first step of a task that blocked or yielded
    /// takes it no further than the kernel's return to it. A task that blocks in a step stands before the
    /// others that wait for the same, and so do, for good, the jobs that it has begun to wait for. One that
    /// has to wait for a mutex, ends, or changes its own priority is not suspended any more: the mutex it
    /// has at its own priority, not at the ceiling. One that makes itself P0 keeps the priority that it
    /// had.
    ///
    /// Other tasks and interrupts wait until the step is made, some 2500 cycles: the way to the task goes by
    /// an instruction at a time.
    ///
    /// # Errors
    /// [`Refused::NotStarted`]; [`Refused::Busy`] unless it is suspended and waits for nothing, and where the
    /// caller is of priority P0.
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
            traversal::end(masked); // the task may go on in the midst of one
            ready::wake(masked, control);
            STEPPED.set(masked, Some(control));
            arm(masked);
            Ok(())
        })?;
        arch::switch_from_call(task);
        task.mask(|masked| {
            // A task that has ended never meets the trap, so this one does.
            PRIORITY.set(masked, None);
            STEPPED.set(masked, Some(ready::running(masked)));
        });
        arch::switch_from_call(task);
        Ok(())
    }
}

/// The trap has found the task, which is the running one. Returns whether the step is made, and the trap to
/// be disabled.
#[doc(hidden)]
pub fn stepped(interrupt: &mut Interrupt) -> bool {
    interrupt.mask(|masked| {
        let Some(priority) = PRIORITY.get(masked) else { return true };
        let control = ready::running(masked);
        let is_ready = ready::is_first(masked, control);
        let locks = control.has_flag(masked, Flag::Locks);
        // A traversal that is broken off here begins anew in the next step, and so in each.
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
        // Where it waits for a mutex, the task that hands that over must find it able to run.
        if !locks {
            control.halt(masked);
        }
        ready::update_head(masked);
        true
    })
}
