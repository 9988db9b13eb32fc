//! How an instance runs, and what it has the harness look at.

use instruction_set::Instruction::{self, Elpm, ElpmIncrement, Lpm, LpmIncrement, Spm};
use simavr_ffi as ffi;

use super::Cpu;

/// Data address of the upper byte of Z.
const ZH: u16 = 31;

// Missing from simavr-ffi's bindings.
unsafe extern "C" {
    fn avr_run_one(avr: *mut ffi::avr_t) -> ffi::avr_flashaddr_t;
}

/// An event at a device of an MCU, for which the bus or the robot polls. Each kind has a pending flag; all
/// flags are in one place, so that a poll reads no device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum News {
    /// The two-wire interface was reset, or the program wrote a register of it.
    Bus,
    /// A serial port has sent a character.
    Sent,
}

impl Cpu {
    /// Begins a run. It ends at `deadline` or at the next cycle timer, whichever comes first, but not before
    /// one instruction. Returns whether simavr has to look at the core before the core executes anything.
    pub fn begin_run(self, deadline: u64) -> bool {
        let avr = self.as_ptr();
        // SAFETY: the instance is alive by the type's invariant; no simavr code runs meanwhile.
        unsafe {
            (*self.control()).deadline = deadline;
            let left = deadline.saturating_sub((*avr).cycle).max(1);
            // simavr's own count dates from before a sleep or an interrupt's response.
            let to_timer = self.next_timer().map_or(left, |when| when.saturating_sub((*avr).cycle));
            (*avr).run_cycle_limit = left;
            (*avr).run_cycle_count = to_timer.clamp(1, left);
        }
        self.must_pause()
    }

    /// Ends the run that has begun after its next instruction, even if that sets a timer as WDR does: simavr
    /// then restarts its count, up to the limit.
    pub fn run_for_one_instruction(self) {
        let avr = self.as_ptr();
        // SAFETY: the instance is alive by the type's invariant.
        unsafe {
            (*avr).run_cycle_limit = 1;
            (*avr).run_cycle_count = 1;
        }
    }

    /// Executes the run that has begun by simavr's own interpreter.
    pub fn run_by_simavr(self) {
        if self.rampz().is_some() {
            return self.run_one_by_simavr();
        }
        self.run_for_one_instruction();
        match self.next_instruction() {
            // A part without RAMPZ has no ELPM: simavr reports that, and then reads far beyond its flash.
            Some(Elpm { .. } | ElpmIncrement { .. }) => self.report("Invalid Opcode: ELPM without RAMPZ"),
            Some(instruction @ (Lpm { .. } | LpmIncrement { .. } | Spm)) => {
                // Upper bits of Z are not decoded. simavr reads and writes beyond its flash.
                let pages = (self.flash_size() / 0x100) as u8; // 0 where Z reaches no further
                let zh = self.data(ZH);
                let beyond = zh & !pages.wrapping_sub(1);
                self.set_data(ZH, zh - beyond);
                self.run_one_by_simavr();
                if instruction != (Lpm { to: ZH as u8 }) {
                    self.set_data(ZH, self.data(ZH).wrapping_add(beyond));
                }
            }
            _ => self.run_one_by_simavr(),
        }
    }

    fn run_one_by_simavr(self) {
        let avr = self.as_ptr();
        // SAFETY: the instance is alive, and no reference into it exists across the call: callbacks use
        // handles of their own.
        unsafe { (*avr).pc = avr_run_one(avr) }
    }

    fn next_instruction(self) -> Option<Instruction> {
        let pc = self.pc() as usize;
        let opcode =
            self.with_flash(|flash| flash.get(pc..)?.first_chunk().map(|&word| u16::from_le_bytes(word)));
        opcode.map(|opcode| instruction_set::decode(0, opcode, 0))
    }

    /// Ends the run with an error, unless simavr has reported one.
    pub fn report(self, error: &str) {
        // SAFETY: `control` lives as long as the instance; the reference ends here.
        unsafe { (*self.control()).fault.get_or_insert_with(|| error.to_owned()) };
        self.call_attention();
    }

    /// Holds a run to its deadline. simavr forgets how much of the run has passed whenever a timer
    /// is registered; every callback that may have done so ends with this.
    pub fn keep_deadline(self) {
        let avr = self.as_ptr();
        // SAFETY: the instance and its `control` are alive by the type's invariant.
        unsafe {
            let control = self.control();
            let left =
                if (*control).attention { 0 } else { (*control).deadline.saturating_sub((*avr).cycle) };
            (*avr).run_cycle_count = (*avr).run_cycle_count.min(left);
        }
    }

    /// Ends the run after the instruction in progress, so that the harness can look at a device.
    pub fn call_attention(self) {
        // SAFETY: the instance and its `control` are alive by the type's invariant.
        unsafe { (*self.control()).attention = true }
        self.keep_deadline();
    }

    /// Whether a device called for attention.
    pub fn attention(self) -> bool {
        // SAFETY: `control` lives as long as the instance.
        unsafe { (*self.control()).attention }
    }

    pub fn clear_attention(self) {
        // SAFETY: `control` lives as long as the instance.
        unsafe { (*self.control()).attention = false }
    }

    /// Sets the pending flag of an event.
    pub fn tell(self, news: News) {
        // SAFETY: `control` lives as long as the instance.
        unsafe { (*self.control()).news[news as usize] = true }
    }

    /// Whether an event is pending.
    pub fn has(self, news: News) -> bool {
        // SAFETY: `control` lives as long as the instance.
        unsafe { (*self.control()).news[news as usize] }
    }

    /// Clears the pending flag of an event. Returns whether it was set.
    pub fn take(self, news: News) -> bool {
        // SAFETY: `control` lives as long as the instance; the reference ends with the call.
        unsafe { std::mem::take(&mut (*self.control()).news[news as usize]) }
    }

    /// Fires the cycle timers that are due; returns the cycles to the next one (1000 if none).
    pub fn process_timers(self) -> u64 {
        // SAFETY: the instance is alive; callbacks use handles of their own.
        unsafe { ffi::avr_cycle_timer_process(self.as_ptr()) }
    }

    /// Cycle of the earliest cycle timer.
    pub fn next_timer(self) -> Option<u64> {
        // SAFETY: the instance is alive; `timer` is null or a slot of its own pool.
        unsafe { (*self.as_ptr()).cycle_timers.timer.as_ref().map(|slot| slot.when) }
    }
}
