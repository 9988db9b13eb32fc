//! Counts that one task keeps and anybody reads. They begin again at 0 after 65,535.

use core::{ptr, slice};

use kernel::{Context, MaskedCell};

/// The counters that `counters` is made of, in order.
///
/// # Safety
/// It is `repr(C)`, and each of its fields is a [`Counter`].
pub(crate) const unsafe fn all<T>(counters: &T) -> &[Counter] {
    // SAFETY: by the caller's promise so many counters lie there, one after the other.
    unsafe { slice::from_raw_parts(ptr::from_ref(counters).cast(), size_of::<T>() / size_of::<Counter>()) }
}

/// A count in two bytes.
#[repr(transparent)]
pub struct Counter(MaskedCell<u16>);

impl Default for Counter {
    fn default() -> Self {
        Self::new()
    }
}

impl Counter {
    /// At 0.
    pub const fn new() -> Self {
        Counter(MaskedCell::new(0))
    }

    /// Counts one more.
    #[inline(always)]
    pub fn count(&self, context: &mut impl Context) {
        context.mask(|masked| self.0.set(masked, self.0.get(masked).wrapping_add(1)));
    }

    /// Takes over a count that is kept elsewhere.
    #[inline(always)]
    pub fn set(&self, context: &mut impl Context, count: u16) {
        context.mask(|masked| self.0.set(masked, count));
    }

    /// What was counted.
    pub fn get(&self, context: &mut impl Context) -> u16 {
        context.mask(|masked| self.0.get(masked))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::{Priority, Stack, Task, host};

    #[test]
    fn it_counts_is_taken_over_and_begins_again() {
        static COUNTER: Counter = Counter::new();
        static STACK: Stack<2000> = Stack::new();
        let body = |task: &mut Task| {
            assert_eq!(COUNTER.get(task), 0);
            COUNTER.count(task);
            COUNTER.count(task);
            assert_eq!(COUNTER.get(task), 2);
            COUNTER.set(task, u16::MAX);
            assert_eq!(COUNTER.get(task), u16::MAX);
            COUNTER.count(task);
            assert_eq!(COUNTER.get(task), 0);
            loop {
                task.delay(kernel::LONGEST);
            }
        };
        host::run_for(1, |boot| STACK.start(boot, Priority::P4, body).expect("the stack is free"), |_, _| {});
    }
}
