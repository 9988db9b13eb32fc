//! How long a task computes from one place where its jobs begin to the next.

use std::collections::BTreeMap;

use crate::mcu::Mcu;

/// The jobs of a task.
pub(crate) struct Jobs {
    /// Where one begins and the one before ends, and the longest that began there.
    begins: BTreeMap<u32, LongestJob>,
    /// Where a task leaves its stack. All addresses are in flash, in bytes.
    switch: u32,
    turn: Option<Turn>,
}

/// The longest job of those that have begun at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LongestJob {
    /// Without the kernel's switches, other tasks and interrupts.
    pub cycles: u64,
    /// How many jobs there were.
    pub times: u64,
}

/// The job that is under way.
#[derive(Default)]
struct Turn {
    /// Where it began.
    begin: u32,
    /// What it has taken until it last went on.
    cycles: u64,
    /// When that was.
    since: u64,
    /// Where the stack pointer is to be when it goes on, while an interrupt or another task runs.
    paused: Option<u16>,
}

/// Bytes of the return address that an interrupt or a call pushes, on the ATmega128.
const RETURN_ADDRESS: u16 = 2;

impl Mcu {
    /// From now on takes note of the jobs of a task, or of tasks with the same code, one at a time: each
    /// begins at one of these places, where the one before ends. `switch` is where the kernel switches to
    /// another task. Addresses in flash, in bytes. The MCU runs slower, and does the same.
    pub fn record_jobs(&mut self, begins: impl IntoIterator<Item = u32>, switch: u32) {
        let begins = begins.into_iter().map(|begin| (begin, LongestJob::default())).collect();
        self.jobs.push(Jobs { begins, switch, turn: None });
    }

    /// The longest jobs since they were [recorded](Self::record_jobs), by where they began.
    pub fn recorded_jobs(&self) -> BTreeMap<u32, LongestJob> {
        self.jobs.iter().flat_map(|jobs| jobs.begins.clone()).collect()
    }

    /// An instruction was executed.
    pub(crate) fn watch_turn(&mut self) {
        let (pc, stack_pointer, now) = (self.pc(), self.stack_pointer(), self.cycle());
        for jobs in &mut self.jobs {
            jobs.watch(pc, stack_pointer, now);
        }
    }

    /// The program has started anew.
    pub(crate) fn drop_turn(&mut self) {
        for jobs in &mut self.jobs {
            jobs.turn = None;
        }
    }

    /// An interrupt was accepted `ago` cycles ago.
    pub(crate) fn pause_turn(&mut self, ago: u64) {
        let (stack_pointer, now) = (self.stack_pointer(), self.cycle());
        for turn in self.jobs.iter_mut().filter_map(|jobs| jobs.turn.as_mut()) {
            turn.pause(stack_pointer, now - ago);
        }
    }
}

impl Jobs {
    fn watch(&mut self, pc: u32, stack_pointer: u16, now: u64) {
        if let Some(turn) = &mut self.turn {
            if turn.paused == Some(stack_pointer) {
                turn.paused = None;
                turn.since = now;
            }
            if turn.paused.is_some() {
                return;
            }
            if pc == self.switch {
                turn.pause(stack_pointer, now);
            }
        }
        if self.begins.contains_key(&pc) {
            if let Some(Turn { begin, cycles, since, .. }) = self.turn.take()
                && let Some(longest) = self.begins.get_mut(&begin)
            {
                longest.cycles = longest.cycles.max(cycles + now - since);
                longest.times += 1;
            }
            self.turn = Some(Turn { begin: pc, since: now, ..Turn::default() });
        }
    }
}

impl Turn {
    /// Something else runs from now on, with the return address on the task's stack.
    fn pause(&mut self, stack_pointer: u16, now: u64) {
        if self.paused.is_none() {
            self.cycles += now - self.since;
            self.paused = Some(stack_pointer + RETURN_ADDRESS);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: u32 = 0x100;
    const OTHER: u32 = 0x180;
    const SWITCH: u32 = 0x200;

    #[test]
    fn what_interrupts_and_other_tasks_take_is_not_counted() {
        let begins = [BEGIN, OTHER].map(|begin| (begin, LongestJob::default())).into();
        let mut jobs = Jobs { begins, switch: SWITCH, turn: None };
        jobs.watch(BEGIN, 0x800, 1_000);
        jobs.watch(BEGIN + 2, 0x800, 1_010);
        let pause = |jobs: &mut Jobs, at| jobs.turn.as_mut().expect("one has begun").pause(0x7fe, at);
        pause(&mut jobs, 1_020); // an interrupt
        jobs.watch(0x300, 0x7f0, 1_040);
        pause(&mut jobs, 1_050); // and one in it
        jobs.watch(BEGIN + 4, 0x800, 1_120);
        jobs.watch(SWITCH, 0x7fe, 1_130); // it waits, and another task runs
        jobs.watch(BEGIN, 0x400, 1_500);
        jobs.watch(BEGIN + 8, 0x800, 2_000);
        assert_eq!(jobs.begins[&BEGIN], LongestJob::default(), "it has not ended");
        jobs.watch(BEGIN, 0x800, 2_003);
        assert_eq!(jobs.begins[&BEGIN], LongestJob { cycles: 20 + 10 + 3, times: 1 });
        jobs.watch(BEGIN, 0x800, 2_004);
        assert_eq!(jobs.begins[&BEGIN], LongestJob { cycles: 33, times: 2 }, "the longest counts");
        jobs.watch(OTHER, 0x800, 2_044);
        assert_eq!(jobs.begins[&BEGIN], LongestJob { cycles: 40, times: 3 }, "it ends where another begins");
        jobs.watch(BEGIN, 0x800, 2_050);
        assert_eq!(jobs.begins[&OTHER], LongestJob { cycles: 6, times: 1 }, "that counts by itself");
    }
}
