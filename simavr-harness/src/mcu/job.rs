//! Measures the jobs of a task: how long it computes from one place where a job begins to the next.

use std::collections::BTreeMap;

use crate::cpu::Cpu;
use crate::mcu::Mcu;

/// The jobs of a task.
pub(crate) struct Jobs {
    /// The addresses at which a job begins and the one before ends, each with the longest job that began
    /// there.
    begins: BTreeMap<u32, LongestJob>,
    /// The address at which a task leaves its stack. All addresses are in flash, in bytes.
    switch: u32,
    turn: Option<Turn>,
}

/// The longest of the jobs that have begun at one address.
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
    /// The address at which it began.
    begin: u32,
    /// The cycles that it took until it was last resumed.
    cycles: u64,
    /// The cycle at which it was last resumed.
    since: u64,
    /// The place at which it resumes, while an interrupt or another task runs.
    paused: Option<Place>,
}

/// Where a task is. The stack pointer alone would not do: a program that sets it writes one byte and then the
/// other.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Place {
    /// In flash, in bytes.
    pc: u32,
    stack_pointer: u16,
}

/// Bytes of the return address that an interrupt or a call pushes, on the ATmega128.
const RETURN_ADDRESS: u16 = 2;

impl Mcu {
    /// Records from now on the jobs of a task, or of tasks with the same code that have jobs one at a time. A
    /// job begins at one of the addresses in `begins`, where the one before ends. At `switch` the kernel
    /// switches to another task. Addresses are in flash, in bytes. The MCU runs slower, and behaves the same.
    pub fn record_jobs(&mut self, begins: impl IntoIterator<Item = u32>, switch: u32) {
        let begins = begins.into_iter().map(|begin| (begin, LongestJob::default())).collect();
        self.jobs.push(Jobs { begins, switch, turn: None });
    }

    /// The longest jobs since [`record_jobs`](Self::record_jobs), by the addresses at which they began.
    pub fn recorded_jobs(&self) -> BTreeMap<u32, LongestJob> {
        self.jobs.iter().flat_map(|jobs| jobs.begins.clone()).collect()
    }

    /// Follows the jobs after each instruction.
    pub(crate) fn watch_turn(&mut self) {
        if self.jobs.is_empty() {
            return;
        }
        let at = Place { pc: self.pc(), stack_pointer: self.stack_pointer() };
        let (cpu, now) = (self.cpu, self.cycle());
        for jobs in &mut self.jobs {
            jobs.watch(at, || returns(cpu), now);
        }
    }

    /// Drops the jobs under way after a reset.
    pub(crate) fn drop_turn(&mut self) {
        for jobs in &mut self.jobs {
            jobs.turn = None;
        }
    }

    /// Pauses the jobs under way for an interrupt that was accepted `ago` cycles ago.
    pub(crate) fn pause_turn(&mut self, ago: u64) {
        if self.jobs.is_empty() {
            return;
        }
        let (returns, now) = (returns(self.cpu), self.cycle());
        for turn in self.jobs.iter_mut().filter_map(|jobs| jobs.turn.as_mut()) {
            turn.pause(returns, now - ago);
        }
    }
}

/// The place to which the return address on top of the stack leads; address 0 if that is not in memory.
fn returns(cpu: Cpu) -> Place {
    let stack_pointer = cpu.stack_pointer();
    let top = cpu.with_data(|data| data.get(usize::from(stack_pointer) + 1..)?.first_chunk().copied());
    let pc = 2 * u32::from(u16::from_be_bytes(top.unwrap_or_default()));
    Place { pc, stack_pointer: stack_pointer.wrapping_add(RETURN_ADDRESS) }
}

impl Jobs {
    /// The program is `at` a place. `returns` gives the place to which its stack would return.
    fn watch(&mut self, at: Place, returns: impl FnOnce() -> Place, now: u64) {
        let Place { pc, .. } = at;
        if let Some(turn) = &mut self.turn {
            if turn.paused == Some(at) {
                turn.paused = None;
                turn.since = now;
            }
            if turn.paused.is_some() {
                return;
            }
            if pc == self.switch {
                turn.pause(returns(), now);
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
    /// Pauses the job until the program returns to this place.
    fn pause(&mut self, returns: Place, now: u64) {
        if self.paused.is_none() {
            self.cycles += now - self.since;
            self.paused = Some(returns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: u32 = 0x100;
    const OTHER: u32 = 0x180;
    const SWITCH: u32 = 0x200;

    /// A task's place.
    fn at(pc: u32) -> Place {
        Place { pc, stack_pointer: 0x800 }
    }

    #[test]
    fn what_interrupts_and_other_tasks_take_is_not_counted() {
        let begins = [BEGIN, OTHER].map(|begin| (begin, LongestJob::default())).into();
        let mut jobs = Jobs { begins, switch: SWITCH, turn: None };
        let nowhere = || Place { pc: 0, stack_pointer: 0 };
        jobs.watch(at(BEGIN), nowhere, 1_000);
        jobs.watch(at(BEGIN + 2), nowhere, 1_010);
        let pause = |jobs: &mut Jobs, now| {
            jobs.turn.as_mut().expect("one has begun").pause(at(BEGIN + 4), now);
        };
        pause(&mut jobs, 1_020); // an interrupt
        jobs.watch(Place { pc: 0x300, stack_pointer: 0x7f0 }, nowhere, 1_040);
        jobs.watch(at(0x302), nowhere, 1_045); // a byte of the stack pointer is another task's
        pause(&mut jobs, 1_050); // and one in it
        jobs.watch(at(BEGIN + 4), nowhere, 1_120);
        // It waits, and another task runs.
        jobs.watch(Place { pc: SWITCH, stack_pointer: 0x7fe }, || at(BEGIN + 8), 1_130);
        jobs.watch(Place { pc: BEGIN, stack_pointer: 0x400 }, nowhere, 1_500);
        jobs.watch(at(BEGIN + 8), nowhere, 2_000);
        assert_eq!(jobs.begins[&BEGIN], LongestJob::default(), "it has not ended");
        jobs.watch(at(BEGIN), nowhere, 2_003);
        assert_eq!(jobs.begins[&BEGIN], LongestJob { cycles: 20 + 10 + 3, times: 1 });
        jobs.watch(at(BEGIN), nowhere, 2_004);
        assert_eq!(jobs.begins[&BEGIN], LongestJob { cycles: 33, times: 2 }, "the longest counts");
        jobs.watch(at(OTHER), nowhere, 2_044);
        assert_eq!(jobs.begins[&BEGIN], LongestJob { cycles: 40, times: 3 }, "it ends where another begins");
        jobs.watch(at(BEGIN), nowhere, 2_050);
        assert_eq!(jobs.begins[&OTHER], LongestJob { cycles: 6, times: 1 }, "that counts by itself");
    }
}
