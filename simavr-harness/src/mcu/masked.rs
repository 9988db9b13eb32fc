//! Measures how long a program keeps interrupts off.

use std::collections::BTreeMap;

use crate::mcu::Mcu;

/// The longest of the stretches with the I flag clear that began at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaskedWindow {
    /// Address in flash (bytes) of the first instruction that ran with interrupts off.
    pub start: u32,
    pub opened_by: OpenedBy,
    /// Cycles from the end of the instruction that cleared I, or from the acceptance of the
    /// interrupt (its response included), to the end of the instruction that set I. If the instruction after
    /// that clears I again, a window of the program goes on, because no interrupt is accepted in between
    /// (ATmega128 datasheet, "Reset and Interrupt Handling"). A window of an interrupt ends nevertheless: the
    /// code to which the interrupt returns is not part of it.
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
    /// The cycle at which the last instruction set I.
    end: Option<u64>,
}

/// The windows of a run.
pub(crate) struct Windows {
    longest: BTreeMap<(u32, OpenedBy), MaskedWindow>,
    open: Option<Open>,
}

impl Mcu {
    /// Records masked windows from now on. The MCU runs slower, and behaves the same.
    pub fn record_masked_windows(&mut self) {
        self.windows = Some(Windows { longest: BTreeMap::new(), open: None });
        if !self.interrupts_enabled() {
            self.open_window(OpenedBy::Start, 0);
        }
    }

    /// The masked windows since [`record_masked_windows`](Self::record_masked_windows), longest first: one
    /// entry for each place and cause, without a window that is still open.
    pub fn recorded_windows(&self) -> Vec<MaskedWindow> {
        let mut windows: Vec<_> =
            self.windows.iter().flat_map(|windows| windows.longest.values().copied()).collect();
        windows.sort_by_key(|window: &MaskedWindow| std::cmp::Reverse(window.cycles));
        windows
    }

    /// Runs up to `cycle` or to the program's end, and returns the masked windows, as
    /// [`recorded_windows`](Self::recorded_windows) does.
    pub fn masked_windows(&mut self, cycle: u64) -> Vec<MaskedWindow> {
        self.record_masked_windows();
        self.run_until(cycle);
        self.recorded_windows()
    }

    /// Opens a window that began `ago` cycles ago, before the next instruction.
    pub(crate) fn open_window(&mut self, opened_by: OpenedBy, ago: u64) {
        let open = Open { start: self.pc(), opened_by, at: self.cycle() - ago, end: None };
        if let Some(windows) = &mut self.windows {
            windows.close();
            windows.open = Some(open);
        }
    }

    /// Opens or closes a window after each instruction.
    pub(crate) fn watch_window(&mut self) {
        let (is_enabled, now) = (self.interrupts_enabled(), self.cycle());
        let Some(windows) = &mut self.windows else { return };
        match (is_enabled, &mut windows.open) {
            (false, None) => self.open_window(OpenedBy::Instruction, 0),
            (false, Some(open)) => open.end = None,
            (true, Some(open)) if open.end.is_none() => {
                open.end = Some(now);
                if matches!(open.opened_by, OpenedBy::Interrupt(_)) {
                    windows.close();
                }
            }
            (true, _) => windows.close(),
        }
    }
}

impl Windows {
    /// Closes the open window. If it has ended, adds it to the longest ones by place and cause.
    fn close(&mut self) {
        let Some(Open { start, opened_by, at, end: Some(end) }) = self.open.take() else { return };
        let known = self.longest.entry((start, opened_by)).or_insert(MaskedWindow {
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
}
