//! Counts that one task keeps and others read. They wrap to 0 after 65,535.

use kernel::{Context, MaskedCell};

/// Declares a struct of counts with these names, which lie in RAM in this order.
macro_rules! counters {
    (
        $(#[$attribute:meta])*
        pub struct $Counters:ident {
            $($(#[$counted:meta])* $name:ident,)*
        }
    ) => {
        $(#[$attribute])*
        #[repr(C)]
        #[derive(Clone, Copy, Default, PartialEq, Eq)]
        #[cfg_attr(not(target_arch = "avr"), derive(Debug))]
        pub struct $Counters<Count = u16> {
            $($(#[$counted])* pub $name: Count,)*
        }

        impl $Counters {
            /// The names of the counts.
            pub const NAMES: [&str; [$(stringify!($name)),*].len()] = [$(stringify!($name)),*];

            /// The counts as they lie in RAM.
            pub const fn from_words([$($name),*]: [u16; Self::NAMES.len()]) -> Self {
                $Counters { $($name),* }
            }
        }

        impl<Count> $Counters<Count> {
            /// What `read` makes of each count.
            #[inline(always)]
            pub fn map<Other>(&self, mut read: impl FnMut(&Count) -> Other) -> $Counters<Other> {
                $Counters { $($name: read(&self.$name)),* }
            }
        }

        impl $Counters<$crate::counter::Counter> {
            /// All at 0.
            pub const fn new() -> Self {
                $Counters { $($name: $crate::counter::Counter::new()),* }
            }

            /// What was counted.
            pub fn read(&self, task: &mut kernel::Task) -> $Counters {
                self.map(|count| count.get(task))
            }

            /// The counts.
            pub const fn all(&self) -> &[$crate::counter::Counter] {
                let first = core::ptr::from_ref(self).cast();
                // SAFETY: the struct is `repr(C)`, and its fields are the `Counter`s that `NAMES` lists: so
                // many of them lie there, one after the other.
                unsafe { core::slice::from_raw_parts(first, $Counters::NAMES.len()) }
            }
        }
    };
}

pub(crate) use counters;

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
