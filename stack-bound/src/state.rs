//! What is known at a place in a program, and how an instruction changes it.

use crate::effect::{Effect, Half, ZERO};
use crate::registers::{Byte, PRESERVED, Pair, Registers, StackPointer};

/// Whether an interrupt may occur before an instruction.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Interrupts {
    Masked,
    /// Enabled from the next instruction on: the one before has just enabled them.
    Soon,
    Enabled,
}

/// What is known at a place besides the stack pointer.
#[derive(Clone, PartialEq, Eq)]
pub struct State {
    registers: Registers,
    /// The bytes pushed last, since the last other use of the stack.
    pushed: Vec<Byte>,
    /// The pair whose upper register was the last to go to SPH: SPL follows.
    written: Option<Pair>,
    /// Whether the stack pointer of this context was read: only then can a switch lead back to it.
    pub is_saved: bool,
    interrupts: Interrupts,
    /// Whether SREG was ever read with interrupts enabled. If so, a write to it may enable them.
    was_enabled: bool,
    /// The address with which the last instruction compared this stack's pointer.
    compared: Option<u16>,
}

impl State {
    /// The state at the start of a function. Interrupts count as masked, as they are in most callers; a call
    /// with interrupts enabled counts them itself.
    pub fn at_start() -> Self {
        State {
            registers: Registers::at_start(),
            pushed: Vec::new(),
            written: None,
            is_saved: false,
            interrupts: Interrupts::Masked,
            was_enabled: false,
            compared: None,
        }
    }

    /// Whether an interrupt may occur before the instruction here.
    pub fn is_interruptible(&self) -> bool {
        self.interrupts == Interrupts::Enabled
    }

    /// Whether interrupts are enabled, now or from the next instruction on.
    pub fn enables_interrupts(&self) -> bool {
        self.interrupts != Interrupts::Masked
    }

    /// The interrupt flag that a write of this register to SREG gives, if that is known.
    pub fn written_flag(&self, from: u8) -> Option<bool> {
        if from == ZERO { Some(false) } else { self.registers.byte(from).highest() }
    }

    /// Whether SPH was written, and SPL was not yet.
    pub fn is_half_written(&self) -> bool {
        self.written.is_some()
    }

    /// Whether a write of this register to SREG gives what this function has neither read there nor made.
    pub fn is_foreign_status(&self, register: u8) -> bool {
        self.written_flag(register).is_none() && self.registers.byte(register) != Byte::Status
    }

    /// Has every later write of an unknown value to SREG enable interrupts.
    pub fn may_enable(&mut self) {
        self.was_enabled = true;
    }

    /// Begins an instruction. Returns the address with which the one before compared this stack's pointer.
    pub fn begin(&mut self) -> Option<u16> {
        if self.interrupts == Interrupts::Soon {
            self.interrupts = Interrupts::Enabled;
        }
        self.compared.take()
    }

    /// The registers that hold what they held at the start, a bit each.
    pub fn preserved(&self) -> u32 {
        self.registers.preserved()
    }

    /// Where Z may point, in bytes of flash.
    pub fn targets(&self) -> Option<Vec<u32>> {
        let words = self.registers.pair(30).values()?;
        Some(words.into_iter().map(|word| u32::from(word) * 2).collect())
    }

    /// How many bytes were on the stack when the stack pointer was copied to Y, if Y still holds that value.
    pub fn depth_at_y(&self) -> Option<i32> {
        match self.registers.pair(28).stack_pointer() {
            StackPointer::Own(depth) => Some(depth),
            StackPointer::Fixed(_) | StackPointer::Elsewhere => None,
        }
    }

    /// Whether an interrupt may occur before the caller's next instruction, after a return here. After `reti`
    /// that instruction still runs.
    pub fn after_return(&self, is_reti: bool) -> Interrupts {
        match self.interrupts {
            Interrupts::Masked if is_reti => Interrupts::Soon,
            Interrupts::Masked => Interrupts::Masked,
            Interrupts::Soon | Interrupts::Enabled => Interrupts::Enabled,
        }
    }

    /// The state after a call has returned that preserves these registers, a bit each, and leaves interrupts
    /// so.
    pub fn after_call(mut self, preserved: u32, interrupts: Interrupts) -> Self {
        self.registers.forget(!(preserved | PRESERVED));
        self.interrupts = self.interrupts.max(interrupts);
        self
    }

    /// Pushes `bytes` of unknown value. Returns the stack pointer then.
    pub fn push_unknown(&mut self, stack_pointer: StackPointer, bytes: u16) -> StackPointer {
        (0..bytes).fold(stack_pointer, |stack_pointer, _| self.push(stack_pointer, Byte::Unknown))
    }

    /// Applies an instruction that leads to the next one. Returns the stack pointer then.
    pub fn apply(&mut self, effect: Effect, stack_pointer: StackPointer) -> StackPointer {
        match effect {
            Effect::Push(from) => return self.push(stack_pointer, self.registers.byte(from)),
            Effect::Pop(to) => {
                self.registers.set(to, self.pushed.pop().unwrap_or(Byte::Unknown));
                return lowered(stack_pointer, -1);
            }
            Effect::ReadStackPointer(half, to) => {
                let byte = match stack_pointer {
                    StackPointer::Own(depth) => Byte::OfStackPointer(half, depth),
                    StackPointer::Fixed(_) | StackPointer::Elsewhere => Byte::Unknown,
                };
                self.registers.set(to, byte);
                self.is_saved |= byte != Byte::Unknown;
            }
            Effect::WriteStackPointer(half, from) => return self.write(half, from, stack_pointer),
            Effect::LoadAboveY(to, _) => self.registers.set(to, Byte::Unknown),
            Effect::Load(to, value) => self.registers.set(to, Byte::Is(value)),
            Effect::SetBits(to, bits) => self.registers.set(to, self.registers.byte(to).with(bits)),
            Effect::KeepBits(to, bits) => self.registers.set(to, self.registers.byte(to).within(bits)),
            Effect::Copy(to, from) => self.registers.set(to, self.registers.byte(from)),
            Effect::CopyPair(to, from) => self.registers.copy_pair(to, from),
            Effect::ComparePair(low, value, high) => {
                let is_own = matches!(self.registers.pair(low).stack_pointer(), StackPointer::Own(_));
                if let (true, Byte::Is(high)) = (is_own, self.registers.byte(high)) {
                    self.compared = Some(u16::from_le_bytes([value, high]));
                }
            }
            Effect::EnableInterrupts => self.enable(),
            Effect::DisableInterrupts => self.interrupts = Interrupts::Masked,
            Effect::ReadStatus(to) => {
                self.was_enabled |= self.enables_interrupts();
                self.registers.set(to, Byte::Status);
            }
            // A value of which nothing is known was read from SREG.
            Effect::WriteStatus(from) if self.written_flag(from).unwrap_or(self.was_enabled) => self.enable(),
            Effect::WriteStatus(_) => self.interrupts = Interrupts::Masked,
            Effect::AddPair(low, amount) => self.registers.add(low, amount),
            Effect::SubtractPair(low, from) => match self.registers.pair(from).stack_pointer() {
                StackPointer::Fixed(amount) => {
                    self.registers.add(low, amount.cast_signed().wrapping_neg());
                }
                StackPointer::Own(_) | StackPointer::Elsewhere => self.registers.forget(0b11 << low),
            },
            Effect::AddByte(low, from) => match self.registers.byte(from) {
                Byte::Is(amount) => self.registers.add(low, amount.into()),
                _ => self.registers.forget(0b11 << low),
            },
            Effect::Other(changed) => self.registers.forget(changed),
            Effect::Jump(_)
            | Effect::JumpIndirect
            | Effect::Call(_)
            | Effect::CallIndirect
            | Effect::Branch(_)
            | Effect::BranchIfSameOrHigher(_)
            | Effect::Skip
            | Effect::Return => {}
        }
        stack_pointer
    }

    /// Enables interrupts. None occurs before the next instruction has run.
    fn enable(&mut self) {
        self.interrupts = self.interrupts.max(Interrupts::Soon);
    }

    fn push(&mut self, stack_pointer: StackPointer, byte: Byte) -> StackPointer {
        self.pushed.push(byte);
        lowered(stack_pointer, 1)
    }

    /// SPH is written first, then SPL from the same pair, as compilers and the kernel do it.
    fn write(&mut self, half: Half, from: u8, stack_pointer: StackPointer) -> StackPointer {
        let pair = self.registers.pair(from);
        if half == Half::High {
            self.written = Some(pair.clone());
            return stack_pointer;
        }
        let is_whole = self.written.take().as_ref() == Some(pair);
        let after = if is_whole { pair.stack_pointer() } else { StackPointer::Elsewhere };
        self.resize(stack_pointer, after);
        if after == StackPointer::Elsewhere {
            self.registers = Registers::unknown();
        }
        after
    }

    /// Makes a frame, or removes one: what was pushed before it is still there.
    fn resize(&mut self, before: StackPointer, after: StackPointer) {
        let (StackPointer::Own(before), StackPointer::Own(after)) = (before, after) else {
            self.pushed.clear();
            return;
        };
        let more = usize::try_from(after - before).unwrap_or(0);
        let fewer = usize::try_from(before - after).unwrap_or(0);
        self.pushed.truncate(self.pushed.len().saturating_sub(fewer));
        self.pushed.extend(std::iter::repeat_n(Byte::Unknown, more));
    }

    /// Keeps what holds on both of two paths that meet.
    pub fn join(&mut self, other: &State) {
        self.registers.join(&other.registers);
        let common = self.pushed.len().min(other.pushed.len());
        self.pushed.drain(..self.pushed.len() - common);
        for (byte, other) in self.pushed.iter_mut().zip(&other.pushed[other.pushed.len() - common..]) {
            if byte != other {
                *byte = Byte::Unknown;
            }
        }
        // On one path SPH was written: from here on that counts for both.
        if self.written != other.written {
            self.written = Some(Pair::unknown());
        }
        self.is_saved |= other.is_saved;
        self.interrupts = self.interrupts.max(other.interrupts);
        self.was_enabled |= other.was_enabled;
        if self.compared != other.compared {
            self.compared = None;
        }
    }
}

fn lowered(stack_pointer: StackPointer, bytes: i16) -> StackPointer {
    match stack_pointer {
        StackPointer::Own(depth) => StackPointer::Own(depth + i32::from(bytes)),
        StackPointer::Fixed(address) => StackPointer::Fixed(address.wrapping_add_signed(-bytes)),
        StackPointer::Elsewhere => StackPointer::Elsewhere,
    }
}
