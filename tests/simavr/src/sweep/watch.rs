//! Watches each instruction of a run.

use simavr_harness::{Mcu, State};

use super::kernel::Kernel;

/// The source of an interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    External,
    Tick,
}

/// The images' marks; see their module `sweep`.
pub const OPEN: u8 = 0x40;
pub const CLOSED: u8 = 0x60;
pub const AUDITED: u8 = 0x61;
/// This mark and higher ones mean that something is wrong.
pub const WRONG: u8 = 0xd0;
const ASK_EXTERNAL: u8 = 0x62;
const ASK_TICK: u8 = 0x63;

/// `out SPH, r` and `out SPL, r`, without the register.
const OUT_SPH: u16 = 0xbe0e;
const OUT_SPL: u16 = 0xbe0d;
const OUT_REGISTER: u16 = 0xfe0f;
/// A tick that only counts returns by this instruction. No interrupt comes directly after it.
const RETI: u16 = 0x9518;

/// The context of a task as an interrupt found it.
#[derive(Clone)]
struct Interrupted {
    task: u16,
    /// Whether the interrupt preempted the kernel itself, where it has interrupts enabled.
    is_kernel: bool,
    pc: u32,
    stack_pointer: u16,
    registers: [u8; 32],
    status: u8,
    /// Whether another task than the head may run when this context continues: a switch was due before, and
    /// the interrupt only counted.
    is_switch_due: bool,
}

/// The observations of a run.
#[derive(Clone)]
pub struct Watch<'k> {
    kernel: &'k Kernel,
    /// Whether both halves of SP belong together.
    stack_pointer_is_whole: bool,
    /// Contexts to which no interrupt has returned yet.
    interrupted: Vec<Interrupted>,
    /// The task that ran when interrupts were last enabled.
    running: u16,
    /// The vectors of the interrupts that wait, and since when they do.
    raised: Vec<(u8, u64)>,
    /// The longest wait of an interrupt, in cycles, including its acceptance.
    pub longest_wait: u64,
    /// How many interrupts were accepted.
    pub accepted: usize,
    /// Whether an interrupt could be accepted before the next instruction if interrupts were enabled. After
    /// an instruction that enables them it could not.
    pub is_boundary: bool,
    /// The last mark, if the last instruction wrote one.
    pub marked: Option<u8>,
    /// The marks so far, without those that ask for interrupts.
    pub marks: Vec<u8>,
    /// The most bytes in use on each stack.
    pub depths: Vec<u16>,
}

impl<'k> Watch<'k> {
    /// A watch for an MCU that runs with interrupts enabled, or is about to start the kernel.
    pub fn new(kernel: &'k Kernel) -> Self {
        Watch {
            kernel,
            stack_pointer_is_whole: true,
            interrupted: Vec::new(),
            running: kernel.idle,
            raised: Vec::new(),
            longest_wait: 0,
            accepted: 0,
            is_boundary: true,
            marked: None,
            marks: Vec::new(),
            depths: vec![0; kernel.stacks.len()],
        }
    }

    /// Whether all interrupted contexts have continued as they were.
    pub fn is_settled(&self) -> bool {
        self.interrupted.is_empty()
    }

    /// Whether another task than the running one should run.
    pub fn is_switch_due(&self, mcu: &Mcu) -> bool {
        self.kernel.head(mcu) != self.kernel.running(mcu)
    }

    /// Whether the running task has blocked, or made a higher one ready, and has not switched yet.
    pub fn is_before_switch(&self, mcu: &Mcu) -> bool {
        mcu.interrupts_enabled()
            && self.is_switch_due(mcu)
            && !self.kernel.is_kernel_stack(mcu.stack_pointer())
    }

    /// Checks that at the end each context that has not continued still lies where the interrupt left it.
    /// Such a task was interrupted on its way from a blocking call to the switch.
    ///
    /// # Errors
    /// The name of a lost task.
    pub fn check_end(&self, mcu: &Mcu) -> Result<(), String> {
        let is_lost = |found: &&Interrupted| {
            let context = self.kernel.preempted_context();
            found.is_kernel
                || self.kernel.preempted_at(mcu, found.task) != Some(found.stack_pointer - context)
        };
        let lost = self.interrupted.iter().find(is_lost);
        lost.map_or(Ok(()), |found| {
            Err(format!("{} was interrupted and is lost", self.kernel.name(found.task)))
        })
    }

    /// Raises an interrupt between two instructions.
    pub fn raise(&mut self, mcu: &mut Mcu, source: Source) {
        let vector = match source {
            Source::External => self.kernel.target.external.vector,
            Source::Tick => self.kernel.target.tick.vector,
        };
        let before = mcu.interrupts_enabled();
        if self.raised.iter().all(|&(waiting, _)| waiting != vector) {
            self.raised.push((vector, mcu.cycle()));
        }
        mcu.raise_interrupt(vector);
        if before && !mcu.interrupts_enabled() {
            let found = self.accept(mcu, vector);
            self.interrupted.extend(found);
        }
    }

    /// Runs one instruction. Raises a tick for an MCU that sleeps, and the interrupts that marks ask for.
    ///
    /// # Errors
    /// What is wrong after the instruction.
    pub fn step(&mut self, mcu: &mut Mcu) -> Result<(), String> {
        if mcu.state() == State::Sleeping {
            self.raise(mcu, Source::Tick);
        }
        let instruction = instruction(mcu);
        let (marks, enabled) = (mcu.markers().len(), mcu.interrupts_enabled());
        let accepted = mcu.step();
        if let Some(accepted) = accepted {
            // The interrupt may have come directly after a return, before an instruction of the context that
            // the return led to.
            if let Some(found) = self.accept(mcu, accepted.vector) {
                self.check_return(mcu, found.pc, found.stack_pointer, found.status)?;
                self.interrupted.push(found);
            }
        } else if !mcu.is_alive() {
            return Err(format!("{:?}", mcu.state()));
        }
        self.is_boundary = enabled || !mcu.interrupts_enabled();
        // A killed task does not continue.
        self.interrupted.retain(|found| self.kernel.is_started(mcu, found.task));
        self.check_stack(mcu, instruction)?;
        self.check_resumed(mcu)?;
        if accepted.is_none() {
            let status = mcu.read(SREG).unwrap_or(0);
            let has_returned = self.check_return(mcu, mcu.pc(), mcu.stack_pointer(), status)?;
            if has_returned && instruction != RETI && !self.raised.is_empty() {
                return Err("the kernel has returned from an interrupt, and another still waits".to_owned());
            }
        }
        self.marked = mcu.markers().get(marks).map(|marker| marker.value);
        if let Some(mark) = self.marked {
            self.note(mcu, mark)?;
        }
        Ok(())
    }

    fn note(&mut self, mcu: &mut Mcu, mark: u8) -> Result<(), String> {
        // The kernel has not started before the first task's first instruction.
        if mcu.interrupts_enabled() {
            self.kernel.check(mcu).map_err(|wrong| format!("at mark {mark:#x}: {wrong}"))?;
        }
        match mark {
            ASK_EXTERNAL => self.raise(mcu, Source::External),
            ASK_TICK => self.raise(mcu, Source::Tick),
            _ => self.marks.push(mark),
        }
        Ok(())
    }

    /// The context that the interrupt `vector`, just accepted, has found; `None` if nothing continues after
    /// it.
    fn accept(&mut self, mcu: &Mcu, vector: u8) -> Option<Interrupted> {
        self.accepted += 1;
        if let Some(index) = self.raised.iter().position(|&(waiting, _)| waiting == vector) {
            let (_, since) = self.raised.swap_remove(index);
            self.longest_wait = self.longest_wait.max(mcu.cycle() - since);
        }
        let task = self.kernel.running(mcu);
        // A broken kernel may have led SP anywhere.
        let below = mcu.stack_pointer();
        let stack_pointer = below.wrapping_add(mcu.part().return_address);
        if task == self.kernel.idle && stack_pointer == mcu.part().ram_end {
            return None; // the idle task has nothing to continue: it begins anew
        }
        let byte = |address| mcu.read(address).unwrap_or(0);
        let pc = (1..=mcu.part().return_address)
            .fold(0, |pc, offset| pc << 8 | u32::from(byte(below.wrapping_add(offset))));
        let only_counts = vector == self.kernel.target.tick.vector && self.kernel.ticks_left(mcu) != 1;
        Some(Interrupted {
            task,
            is_kernel: self.kernel.is_kernel_stack(stack_pointer),
            pc: pc * 2,
            stack_pointer,
            registers: std::array::from_fn(|register| byte(register as u16)),
            status: byte(SREG) | INTERRUPTS_ENABLED,
            is_switch_due: only_counts && self.kernel.head(mcu) != task,
        })
    }

    /// Checks that SP lies in the stack in use, and that no task's stack has more than one context of an
    /// interrupt.
    fn check_stack(&mut self, mcu: &Mcu, instruction: u16) -> Result<(), String> {
        match instruction & OUT_REGISTER {
            OUT_SPH => self.stack_pointer_is_whole = false,
            OUT_SPL => self.stack_pointer_is_whole = true,
            _ => {}
        }
        if !self.stack_pointer_is_whole {
            return Ok(());
        }
        let stack_pointer = mcu.stack_pointer();
        let stacks = &self.kernel.stacks;
        let Some(index) = stacks.iter().position(|stack| stack.holds(stack_pointer)) else {
            return Err(format!("SP {stack_pointer:#x} lies in no stack"));
        };
        let stack = &stacks[index];
        self.depths[index] = self.depths[index].max(stack.highest - stack_pointer);
        // The second half of a preempted context is not pushed through SP.
        for (stack, depth) in stacks.iter().zip(&mut self.depths).skip(1) {
            if let Some(context) = self.kernel.preempted_at(mcu, stack.control)
                && stack.holds(context)
            {
                *depth = (*depth).max(stack.highest - context);
            }
        }
        if mcu.interrupts_enabled()
            && stack.control != self.kernel.running(mcu)
            && !self.kernel.is_kernel_stack(stack_pointer)
        {
            return Err(format!("the running task uses the stack of {}", stack.name));
        }
        let is_beyond = |found: &Interrupted| {
            found.task == stack.control
                && !found.is_kernel
                && stack_pointer + self.kernel.preempted_context() < found.stack_pointer
        };
        if self.interrupted.iter().any(is_beyond) {
            return Err(format!("on the stack of {} lies more than one context of an interrupt", stack.name));
        }
        Ok(())
    }

    /// Checks that a resumed task is the one that should run. The idle task is an exception: it is the
    /// running task while a preempted context is loaded.
    fn check_resumed(&mut self, mcu: &Mcu) -> Result<(), String> {
        if !mcu.interrupts_enabled() {
            return Ok(());
        }
        let (running, head) = (self.kernel.running(mcu), self.kernel.head(mcu));
        let is_resumed = running != self.running && running != self.kernel.idle;
        self.running = running;
        if is_resumed && running != head {
            return Err(format!(
                "{} is resumed where {} should be",
                self.kernel.name(running),
                self.kernel.name(head)
            ));
        }
        Ok(())
    }

    /// Checks that where an interrupted task continues, every register is as it was, and it is the task that
    /// should run. Returns whether a task continues here.
    fn check_return(&mut self, mcu: &Mcu, pc: u32, stack_pointer: u16, status: u8) -> Result<bool, String> {
        let goes_on = |found: &Interrupted| found.pc == pc && found.stack_pointer == stack_pointer;
        let Some(index) = self.interrupted.iter().position(goes_on) else { return Ok(false) };
        let found = self.interrupted.swap_remove(index);
        let byte = |address| mcu.read(address).unwrap_or(0);
        for (register, &before) in found.registers.iter().enumerate() {
            let now = byte(register as u16);
            if now != before {
                return Err(format!(
                    "r{register} was {before:#x} before the interrupt and is {now:#x} after it"
                ));
            }
        }
        if status != found.status {
            return Err(format!("SREG was {:#x} and is {status:#x}", found.status));
        }
        let checked = if found.is_switch_due || found.is_kernel {
            self.kernel.check_lists(mcu)
        } else {
            self.kernel.check(mcu)
        };
        checked.map_err(|wrong| format!("after an interrupt: {wrong}"))?;
        Ok(true)
    }
}

/// Data address of the status register, and its flag I.
const SREG: u16 = 0x5f;
const INTERRUPTS_ENABLED: u8 = 0x80;

/// The next instruction.
fn instruction(mcu: &Mcu) -> u16 {
    let at = mcu.pc() as usize;
    mcu.image().flash().get(at..at + 2).map_or(0, |bytes| u16::from_le_bytes([bytes[0], bytes[1]]))
}
