//! Single steps of tasks, by Timer2.
//!
//! Timer2 reaches its compare value every second clock, so that its interrupt is pending again at once after
//! it was taken. Of all interrupts that this crate drives only external ones have priority over it, and they
//! are disabled during a step. So a step may spoil a character on the UART in software. A stepped critical
//! section finds EIMSK at 0. An interrupt that it enables there stays enabled, but one that it disables is
//! enabled again: do not step a task while it begins to send by that UART.

use kernel::{Context, Interrupt, MaskedCell, Refused, Task, TaskHandle};

use crate::interrupts::Serves;
use crate::mcu;

/// The external interrupts' enable register (EIMSK) before the step.
static EXTERNAL: MaskedCell<u8> = MaskedCell::new(0);

/// The timer of single steps: Timer2.
pub struct Trap(());

impl Trap {
    pub(crate) const fn new() -> Self {
        Trap(())
    }

    /// Starts Timer2, which counts from here on.
    pub fn start(self, _: impl Serves<Trap>) -> Stepper {
        mcu::start_timer2();
        Stepper(())
    }
}

/// Makes tasks step.
pub struct Stepper(());

impl Stepper {
    /// Runs one instruction of a suspended task: see [`TaskHandle::step`].
    ///
    /// # Errors
    /// Those of [`TaskHandle::step`].
    pub fn step(&mut self, task: &mut Task, stepped: TaskHandle) -> Result<(), Refused> {
        stepped.step(task, |masked| {
            EXTERNAL.set(masked, mcu::hold_external());
            mcu::enable_timer2(true);
        })
    }
}

/// Disables the trap: the step is complete.
#[doc(hidden)]
#[inline(always)]
pub fn disarm(interrupt: &mut Interrupt) {
    interrupt.mask(|masked| {
        mcu::enable_timer2(false);
        mcu::release_external(EXTERNAL.get(masked));
    });
}
