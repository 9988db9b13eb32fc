//! How long a task computes from one time that it comes to a place to the next.

use crate::mcu::Mcu;

/// The turns of a task's loop.
pub(crate) struct Jobs {
    /// Addresses in flash (bytes): where a turn begins and ends, and where a task leaves its stack.
    begin: u32,
    switch: u32,
    turn: Option<Turn>,
    longest: u64,
    times: u64,
}

/// The turn that is under way.
#[derive(Default)]
struct Turn {
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
    /// From now on takes note of the turns of a task's loop that begin at `begin`. `switch` is where the kernel
    /// switches to another task. Addresses in flash, in bytes. The MCU runs slower, and does the same.
    pub fn record_turns(&mut self, begin: u32, switch: u32) {
        self.jobs = Some(Jobs { begin, switch, turn: None, longest: 0, times: 0 });
    }

    /// The most cycles of a turn since turns were [recorded](Self::record_turns), without the kernel's
    /// switches, other tasks and interrupts; and how many turns there were.
    pub fn recorded_turns(&self) -> (u64, u64) {
        self.jobs.as_ref().map_or((0, 0), |jobs| (jobs.longest, jobs.times))
    }

    /// An instruction was executed.
    pub(crate) fn watch_turn(&mut self) {
        let (pc, stack_pointer, now) = (self.pc(), self.stack_pointer(), self.cycle());
        if let Some(jobs) = &mut self.jobs {
            jobs.watch(pc, stack_pointer, now);
        }
    }

    /// The program has started anew.
    pub(crate) fn drop_turn(&mut self) {
        if let Some(jobs) = &mut self.jobs {
            jobs.turn = None;
        }
    }

    /// An interrupt was accepted `ago` cycles ago.
    pub(crate) fn pause_turn(&mut self, ago: u64) {
        let (stack_pointer, now) = (self.stack_pointer(), self.cycle());
        if let Some(turn) = self.jobs.as_mut().and_then(|jobs| jobs.turn.as_mut()) {
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
        if pc == self.begin {
            if let Some(Turn { cycles, since, .. }) = self.turn.take() {
                self.longest = self.longest.max(cycles + now - since);
                self.times += 1;
            }
            self.turn = Some(Turn { since: now, ..Turn::default() });
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
    const SWITCH: u32 = 0x200;

    #[test]
    fn what_interrupts_and_other_tasks_take_is_not_counted() {
        let mut jobs = Jobs { begin: BEGIN, switch: SWITCH, turn: None, longest: 0, times: 0 };
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
        assert_eq!((jobs.longest, jobs.times), (0, 0), "it has not ended");
        jobs.watch(BEGIN, 0x800, 2_003);
        assert_eq!((jobs.longest, jobs.times), (20 + 10 + 3, 1));
        jobs.watch(BEGIN, 0x800, 2_004);
        assert_eq!((jobs.longest, jobs.times), (33, 2), "the longest counts");
    }
}
