//! Whether a periodic task keeps its period. The task that feeds the watchdog asks this.
//!
//! A task that hangs in a loop is noticed without a duty: no task below it runs any more, and the lowest
//! periodic one feeds the watchdog. A task that waits for an event that never comes is noticed by its duty.

use kernel::{Context, MaskedCell, Ticks, is_reached, now};

/// What a task has promised: when it will be back at the latest.
pub struct Duty {
    due: MaskedCell<Option<Ticks>>,
}

impl Duty {
    /// Nothing was promised yet.
    pub const fn new() -> Self {
        Duty { due: MaskedCell::new(None) }
    }

    /// The calling task promises to call again within this many ticks of 1 ms.
    #[inline(always)]
    pub fn promise(&self, context: &mut impl Context, within: Ticks) {
        let due = now(context).wrapping_add(within);
        context.mask(|masked| self.due.set(masked, Some(due)));
    }

    /// The task promises nothing: it has nothing to do until it is asked to.
    pub fn rest(&self, context: &mut impl Context) {
        context.mask(|masked| self.due.set(masked, None));
    }

    /// Whether the task has kept its promise so far.
    pub fn is_kept(&self, context: &mut impl Context) -> bool {
        let time = now(context);
        let due = context.mask(|masked| self.due.get(masked));
        due.is_none_or(|due| is_reached(time, due))
    }
}

impl Default for Duty {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use kernel::{LONGEST, Priority, Stack, host};
    use std::sync::Mutex;
    use std::vec::Vec;

    #[test]
    fn a_promise_is_kept_until_its_time_is_over() {
        static DUTY: Duty = Duty::new();
        static STACK: Stack<96> = Stack::new();
        static KEPT: Mutex<Vec<bool>> = Mutex::new(Vec::new());
        let note = |kept| KEPT.lock().expect("no test panicked with it").push(kept);
        host::run_for(
            u32::from(u16::MAX) + 20,
            |boot| {
                let body = move |task: &mut kernel::Task| {
                    // The clock begins anew before the first promise is due.
                    task.delay(LONGEST);
                    task.delay(LONGEST);
                    note(DUTY.is_kept(task)); // nothing was promised
                    DUTY.promise(task, 5);
                    note(DUTY.is_kept(task));
                    task.delay(5);
                    note(DUTY.is_kept(task));
                    task.delay(1);
                    note(DUTY.is_kept(task)); // late
                    DUTY.promise(task, 5);
                    note(DUTY.is_kept(task));
                    task.delay(6);
                    DUTY.rest(task);
                    note(DUTY.is_kept(task));
                    loop {
                        task.delay(LONGEST);
                    }
                };
                STACK.start(boot, Priority::P0, body).expect("the stack is free");
            },
            |_, _| {},
        );
        assert_eq!(*KEPT.lock().expect("no test panicked with it"), [true, true, true, false, true, true]);
    }
}
