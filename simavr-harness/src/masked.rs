//! How long a program keeps interrupts off.

use std::collections::BTreeMap;

use crate::mcu::Mcu;

/// A stretch of a run with the I flag off, the longest of those that began at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaskedWindow {
    /// Address in flash (bytes) of the first instruction that ran with interrupts off.
    pub start: u32,
    pub opened_by: OpenedBy,
    /// Cycles from the end of the instruction that cleared I, or from the acceptance of the
    /// interrupt (its response included), to the end of the instruction that set I.
    pub cycles: u64,
    /// Cycle of the run at which it began.
    pub at: u64,
    /// How often a window began there.
    pub times: u64,
}

/// What turned interrupts off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum OpenedBy {
    /// The start of the run, or a reset: until the program first turns interrupts on.
    Start,
    /// An instruction.
    Instruction,
    /// The acceptance of the interrupt with this vector number.
    Interrupt(u8),
}

struct Open {
    start: u32,
    opened_by: OpenedBy,
    at: u64,
}

impl Mcu {
    /// Runs up to `cycle` or to the program's end, one instruction at a time, and returns the masked
    /// windows, longest first: one entry for each place and cause. A window that the end of the run
    /// cuts off is not among them.
    pub fn masked_windows(&mut self, cycle: u64) -> Vec<MaskedWindow> {
        let mut longest = BTreeMap::new();
        let mut open = (!self.interrupts_enabled()).then(|| self.open(OpenedBy::Start, 0));
        while self.is_alive() && self.cycle() < cycle {
            let resets = self.resets();
            if let Some(accepted) = self.step() {
                let opened_by = OpenedBy::Interrupt(accepted.vector);
                open = Some(self.open(opened_by, accepted.response_cycles));
            } else if self.resets() != resets {
                open = Some(self.open(OpenedBy::Start, 0));
            } else if !self.interrupts_enabled() {
                open = open.or_else(|| Some(self.open(OpenedBy::Instruction, 0)));
            } else if let Some(window) = open.take() {
                close(&mut longest, window, self.cycle());
            }
        }
        let mut windows: Vec<_> = longest.into_values().collect();
        windows.sort_by_key(|window: &MaskedWindow| std::cmp::Reverse(window.cycles));
        windows
    }

    /// A window that began `ago` cycles ago, before the instruction to come.
    fn open(&self, opened_by: OpenedBy, ago: u64) -> Open {
        Open { start: self.pc(), opened_by, at: self.cycle() - ago }
    }
}

/// Adds a window to the longest ones by place and cause.
fn close(longest: &mut BTreeMap<(u32, OpenedBy), MaskedWindow>, window: Open, end: u64) {
    let Open { start, opened_by, at } = window;
    let known = longest.entry((start, opened_by)).or_insert(MaskedWindow {
        start,
        opened_by,
        cycles: 0,
        at,
        times: 0,
    });
    known.times += 1;
    if end - at > known.cycles {
        known.cycles = end - at;
        known.at = at;
    }
}
