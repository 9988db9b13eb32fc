//! Single steps: a suspended task runs for one instruction.
//!
//! The AVR runs one instruction after `reti` before it takes the next interrupt (ATmega128 datasheet, "Reset and Interrupt
//! Handling"). So the task is made the head, an interrupt that stays pending is let loose, the *trap*, and wherever that finds
//! another than the task at work it returns: the kernel, and interrupts, get on by an instruction at a time. When it finds the
//! task, that has made its step. Nothing preempts it meanwhile.
//!
//! What the task does with interrupts masked counts as one step, as nothing can come between.

use crate::KERNEL;
use crate::arch;
use crate::context::{Context, Interrupt, Task};
use crate::handle::{Refused, TaskHandle};
use crate::link::Link;
use crate::masked::{Masked, MaskedCell};
use crate::ready;
use crate::task::ControlBlock;

/// The task that is to make a step.
#[doc(hidden)]
pub static STEPPED: MaskedCell<Option<&'static ControlBlock>> = MaskedCell::new(None);

impl TaskHandle {
    /// Runs one instruction of the task, which is suspended and does not wait. `spring` lets the trap loose: from there on the
    /// vector declared by [`trap_interrupt!`](crate::trap_interrupt!) is pending.
    ///
    /// Tasks of higher priority wait until the step is made: up to about 50 cycles for each instruction of the switch to the task,
    /// some 4000 in all.
    ///
    /// # Errors
    /// [`Refused::NotStarted`]; [`Refused::Busy`] unless it is suspended, and waits for nothing.
    pub fn step(self, task: &mut Task, spring: impl FnOnce(&Masked)) -> Result<(), Refused> {
        task.mask(|masked| {
            let control = self.control;
            if control.stack_pointer.get(masked) == 0 {
                return Err(Refused::NotStarted);
            }
            if !control.is_suspended(masked) || control.link.get(masked) != Link::PARKED {
                return Err(Refused::Busy);
            }
            control.above.set(masked, 0);
            control.link.set(masked, Link::to(KERNEL.ready.head.get(masked)));
            KERNEL.ready.head.set(masked, control);
            STEPPED.set(masked, Some(control));
            spring(masked);
            Ok(())
        })?;
        arch::switch_from_call();
        // Whoever has arrived meanwhile.
        if ready::restore(task) {
            arch::switch_from_call();
        }
        Ok(())
    }
}

/// The step is made: the task is suspended again. In the handler of the trap.
#[doc(hidden)]
pub fn stepped(interrupt: &mut Interrupt) {
    interrupt.mask(|masked| {
        let Some(control) = STEPPED.get(masked) else { return };
        STEPPED.set(masked, None);
        control.suspend(masked);
        if KERNEL.ready.head.get(masked).is(control) {
            KERNEL.ready.head.set(masked, control.next_ready(masked));
            control.link.set(masked, Link::PARKED);
        }
    });
}
