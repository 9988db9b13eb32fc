//! Waits for several semaphores at once.
//!
//! A task can be in one list only. So where it waits for several, others wait in its place: control blocks without a stack,
//! suspended for good. One that is woken joins its group, and that wakes the task.

use core::ptr;

use crate::arch;
use crate::context::{Context, Task};
use crate::link::Link;
use crate::list;
use crate::masked::{Masked, MaskedCell};
use crate::ready;
use crate::semaphore::Semaphore;
use crate::task::{ControlBlock, Flag};

/// What stands in for a task where that waits for one of several semaphores.
#[repr(C)]
pub(crate) struct StandIn {
    /// First, so that its address is this one's.
    pub(crate) control: ControlBlock,
    pub(crate) semaphore: &'static Semaphore,
}

impl StandIn {
    pub(crate) const fn new(semaphore: &'static Semaphore) -> StandIn {
        StandIn { control: ControlBlock::new(), semaphore }
    }
}

/// Those that stand in for a task.
#[repr(C)]
pub(crate) struct Group {
    /// The last of those that were woken; its link is the first.
    pub(crate) last: ready::Last,
    pub(crate) task: &'static ControlBlock,
}

impl Group {
    /// A group that stands in for the running task.
    pub(crate) fn new(task: &mut Task) -> Group {
        #[cfg(target_arch = "avr")]
        arch::name_stand_in();
        Group { last: MaskedCell::new(None), task: task.mask(ready::running) }
    }

    /// The group of `stand_in`.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn of(masked: &Masked, stand_in: &ControlBlock) -> &'static Group {
        // SAFETY: `claim` stored it from a static.
        unsafe { &*ptr::with_exposed_provenance(stand_in.stack_pointer.get(masked)) }
    }

    /// Makes `stand_in` one of this group, unless it is one of another. Returns whether it did.
    pub(crate) fn claim(&'static self, masked: &Masked, stand_in: &'static ControlBlock) -> bool {
        let is_free = stand_in.stack_pointer.get(masked) == 0;
        if is_free {
            stand_in.stack_pointer.set(masked, ptr::from_ref(self).expose_provenance());
            stand_in.change_priority(masked, self.task.priority(masked));
            stand_in.set_flag(masked, Flag::StandsIn);
            stand_in.suspend(masked);
        }
        is_free
    }

    /// `stand_in` has been woken. Returns the task it stands in for, if that waits.
    #[cfg(not(target_arch = "avr"))]
    pub(crate) fn arrive(
        &self,
        masked: &Masked,
        stand_in: &'static ControlBlock,
    ) -> Option<&'static ControlBlock> {
        self.append(masked, stand_in);
        (self.task.link.get(masked) == Link::GROUPED).then_some(self.task)
    }

    /// Puts `stand_in` behind those that were woken.
    #[inline(always)]
    pub(crate) fn append(&self, masked: &Masked, stand_in: &'static ControlBlock) {
        let first = match self.last.get(masked) {
            Some(last) => last.link.replace(masked, Link::to(stand_in)),
            None => Link::to(stand_in),
        };
        stand_in.link.set(masked, first);
        self.last.set(masked, Some(stand_in));
    }

    /// The first that was woken; blocks until there is one.
    pub(crate) fn receive(&self, task: &mut Task) -> &'static ControlBlock {
        loop {
            if let Some(first) = task.mask(|masked| self.take(masked)) {
                return first;
            }
            if ready::block_unless(task, Link::GROUPED, |masked| self.last.get(masked).is_some()) {
                arch::switch_from_call();
            }
        }
    }

    fn take(&self, masked: &Masked) -> Option<&'static ControlBlock> {
        let last = self.last.get(masked)?;
        let (first, _) = ready::take_first(masked, &self.last, last);
        Some(first)
    }
}

impl Task {
    /// Takes a signal of one of `semaphores`, and blocks until there is one; of several the first. Returns its index.
    ///
    /// A wait for one thing with a time-out has [`Semaphore::wait_timeout`]; this one ends in time if a
    /// [`Timer`](crate::Timer) posts one of the semaphores. 8 bytes of stack a semaphore, and 5. Linear in the number of
    /// tasks that wait for them, in steps.
    pub fn wait_any<const N: usize>(&mut self, semaphores: [&Semaphore; N]) -> usize {
        if let Some(index) = semaphores.iter().position(|semaphore| semaphore.try_wait(self)) {
            return index;
        }
        let group = Group::new(self);
        // SAFETY: these borrows end with the wait below, as the two of `group` and `stand_ins` do.
        let stand_ins = semaphores.map(|semaphore| StandIn::new(unsafe { &*ptr::from_ref(semaphore) }));
        // SAFETY: below all that wait are expelled, or have been woken, before this returns; and a task for which others wait
        // is not killed.
        let (group, stand_ins): (&'static Group, &'static [StandIn; N]) =
            unsafe { (&*ptr::from_ref(&group), &*ptr::from_ref(&stand_ins)) };
        self.mask(|masked| group.task.set_flag(masked, Flag::Represented));
        let came = stand_ins.iter().position(|StandIn { control, semaphore }| {
            self.mask(|masked| group.claim(masked, control));
            !semaphore.enlist(self, control)
        });
        let sent = came.unwrap_or(N);
        let came = came.unwrap_or_else(|| {
            let woken = group.receive(self);
            stand_ins.iter().position(|stand_in| stand_in.control.is(woken)).unwrap_or(0)
        });
        for (index, StandIn { control, semaphore }) in stand_ins.iter().enumerate().take(sent) {
            if index != came && !list::expel(self, semaphore, control, |_| {}) {
                // It has taken a signal too.
                semaphore.post(self);
            }
        }
        self.mask(|masked| group.task.clear_flag(masked, Flag::Represented));
        came
    }
}
