//! What is known at a place in a program, and what an instruction makes of it.

use crate::instruction::{Half, Instruction};
use crate::registers::{Byte, Pair, Registers, StackPointer};

/// What is known besides the stack pointer.
#[derive(Clone, PartialEq, Eq)]
pub struct State {
    registers: Registers,
    /// The bytes pushed last, as far as no other use of the stack came between.
    pushed: Vec<Byte>,
    /// The pair whose upper register was the last to go to SPH: SPL follows.
    written: Option<Pair>,
    /// Whether the stack pointer of this context was read: only then can a switch lead back to it.
    pub is_saved: bool,
}

impl State {
    /// At the start of a function.
    pub fn unknown() -> Self {
        State { registers: Registers::unknown(), pushed: Vec::new(), written: None, is_saved: false }
    }

    /// Where Z may point, in bytes of flash.
    pub fn targets(&self) -> Option<Vec<u32>> {
        let words = self.registers.pair(30).values()?;
        Some(words.into_iter().map(|word| u32::from(word) * 2).collect())
    }

    /// How many bytes were on the stack when Y took the stack pointer, if it still holds that.
    pub fn depth_at_y(&self) -> Option<i32> {
        match self.registers.pair(28).stack_pointer() {
            StackPointer::Own(depth) => Some(depth),
            StackPointer::Fixed(_) | StackPointer::Elsewhere => None,
        }
    }

    /// After a call has come back.
    pub fn after_call(mut self) -> Self {
        self.registers.call();
        self
    }

    /// After `bytes` that nobody follows were pushed.
    pub fn push_unknown(&mut self, stack_pointer: StackPointer, bytes: u16) -> StackPointer {
        (0..bytes).fold(stack_pointer, |stack_pointer, _| self.push(stack_pointer, Byte::Unknown))
    }

    /// After an instruction that leads to the next; returns the stack pointer then.
    pub fn apply(&mut self, instruction: Instruction, stack_pointer: StackPointer) -> StackPointer {
        match instruction {
            Instruction::Push(from) => return self.push(stack_pointer, self.registers.byte(from)),
            Instruction::Pop(to) => {
                self.registers.set(to, self.pushed.pop().unwrap_or(Byte::Unknown));
                return lowered(stack_pointer, -1);
            }
            Instruction::ReadStackPointer(half, to) => {
                let byte = match stack_pointer {
                    StackPointer::Own(depth) => Byte::OfStackPointer(half, depth),
                    StackPointer::Fixed(_) | StackPointer::Elsewhere => Byte::Unknown,
                };
                self.registers.set(to, byte);
                self.is_saved |= byte != Byte::Unknown;
            }
            Instruction::WriteStackPointer(half, from) => return self.write(half, from, stack_pointer),
            Instruction::LoadAboveY(to, _) => self.registers.set(to, Byte::Unknown),
            Instruction::Load(to, value) => self.registers.set(to, Byte::Is(value)),
            Instruction::Copy(to, from) => self.registers.set(to, self.registers.byte(from)),
            Instruction::CopyPair(to, from) => self.registers.copy_pair(to, from),
            Instruction::AddPair(low, amount) => self.registers.add(low, amount),
            Instruction::Other(changed) => self.registers.forget(changed),
            Instruction::Jump(_)
            | Instruction::JumpIndirect
            | Instruction::Call(_)
            | Instruction::CallIndirect
            | Instruction::Branch(_)
            | Instruction::Skip
            | Instruction::Return => {}
        }
        stack_pointer
    }

    fn push(&mut self, stack_pointer: StackPointer, byte: Byte) -> StackPointer {
        self.pushed.push(byte);
        lowered(stack_pointer, 1)
    }

    /// SPH is written first, SPL after it from the same pair: so do compilers, and the kernel.
    fn write(&mut self, half: Half, from: u8, stack_pointer: StackPointer) -> StackPointer {
        let pair = self.registers.pair(from);
        if half == Half::High {
            self.written = Some(pair.clone());
            return stack_pointer;
        }
        let is_whole = self.written.take().as_ref() == Some(pair);
        self.pushed.clear();
        if is_whole { pair.stack_pointer() } else { StackPointer::Elsewhere }
    }

    /// What is known where two ways meet.
    pub fn join(&mut self, other: &State) {
        self.registers.join(&other.registers);
        let common = self.pushed.len().min(other.pushed.len());
        self.pushed.drain(..self.pushed.len() - common);
        for (byte, other) in self.pushed.iter_mut().zip(&other.pushed[other.pushed.len() - common..]) {
            if byte != other {
                *byte = Byte::Unknown;
            }
        }
        if self.written != other.written {
            self.written = None;
        }
        self.is_saved |= other.is_saved;
    }
}

fn lowered(stack_pointer: StackPointer, bytes: i16) -> StackPointer {
    match stack_pointer {
        StackPointer::Own(depth) => StackPointer::Own(depth + i32::from(bytes)),
        StackPointer::Fixed(address) => StackPointer::Fixed(address.wrapping_add_signed(-bytes)),
        StackPointer::Elsewhere => StackPointer::Elsewhere,
    }
}
