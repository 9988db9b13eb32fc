//! How deep the stacks of an MCU have been used.

use simavr_harness::{Mcu, Place};

/// What a stack that was never used holds.
const PAINT: u8 = 0xa5;

/// What a task's control block takes at the start of its stack's `static`, in bytes.
const CONTROL_BLOCK: u16 = 6;

/// Where the statics of the firmware's module `stack` are named, in the mangled form.
const MODULE: &str = "5stack";

/// The most cycles from reset to `main`.
const START_UP: u64 = 100_000;

/// A task's stack.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TaskStack {
    pub name: String,
    start: u16,
    pub size: u16,
}

/// The stacks of the tasks of an MCU, painted before its program begins.
pub struct Stacks(Vec<TaskStack>);

impl Stacks {
    /// Runs an MCU that has just powered up to its `main`, where SRAM has been cleared and no task has started, and
    /// paints the stacks.
    ///
    /// # Panics
    /// When the image has no `main` or no stacks.
    pub fn paint(mcu: &mut Mcu) -> Self {
        let main = mcu.image().symbol("main").map(|symbol| symbol.place);
        while main != Some(Place::Flash(mcu.pc())) {
            assert!(mcu.cycle() < START_UP, "main was not reached");
            mcu.step();
        }
        let image = mcu.image().clone();
        let mut stacks: Vec<_> = image
            .symbols()
            .filter_map(|(name, symbol)| {
                let (_, name) = name.split_once(MODULE)?;
                let Place::Data(start) = symbol.place else { return None };
                let name = name.trim_start_matches(|digit: char| digit.is_ascii_digit()).to_owned();
                Some(TaskStack { name, start: start + CONTROL_BLOCK, size: symbol.size - CONTROL_BLOCK })
            })
            .collect();
        assert!(!stacks.is_empty(), "the image has no stacks");
        stacks.sort();
        for stack in &stacks {
            for address in stack.start..stack.start + stack.size {
                mcu.write(address, PAINT);
            }
        }
        Stacks(stacks)
    }

    /// The stacks, and of each how many bytes at its far end no push has ever reached.
    pub fn unused<'a>(&'a self, mcu: &'a Mcu) -> impl Iterator<Item = (&'a TaskStack, u16)> {
        self.0.iter().map(|stack| {
            let bytes = stack.start..stack.start + stack.size;
            let unused = bytes.take_while(|&address| mcu.read(address) == Some(PAINT)).count();
            (stack, unused as u16)
        })
    }
}
