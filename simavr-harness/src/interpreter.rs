//! Executes a program on an instance of simavr faster than simavr does: instructions are decoded once for all MCUs that run
//! the program.
//!
//! It does to the instance what simavr's own interpreter would, cycle by cycle, and leaves to that what is rare: SLEEP,
//! WDR, ELPM, accesses beyond memory, whatever is no instruction.

use std::cell::Cell;

use crate::cpu::{Access, CoreState, Cpu};
use instruction::{Instruction, Z};
use status::{INTERRUPT, Status, TRANSFER};

pub(crate) mod instruction;
mod status;

/// Data addresses of registers that the core itself uses.
const SPL: u16 = 0x5d;
const SPH: u16 = 0x5e;
const SREG: u16 = 0x5f;

/// Where the core's registers end and I/O registers begin.
const IO_START: u16 = 0x20;

/// Executes instructions as simavr's interpreter does, until the run ends or an instruction comes that it does not know.
/// Returns whether the run has ended.
pub(crate) fn run(cpu: Cpu, program: &[Instruction]) -> bool {
    cpu.with_cells(|data| {
        let Some(registers) = data.first_chunk() else { return false };
        let core = Core {
            cpu,
            registers,
            data,
            ram_start: cpu.ram_start(),
            return_address: cpu.return_address_size(),
        };
        let mut now = Now::load(cpu);
        let ended = core.run(&mut now, program);
        now.store(cpu);
        ended
    })
}

/// Where the program is.
#[derive(Clone, Copy)]
struct Now {
    /// Word address of the instruction.
    pc: u32,
    /// Cycle at which it began.
    cycle: u64,
    /// The run ends at the first instruction boundary at or after this cycle.
    stop: u64,
    status: Status,
}

/// What follows an instruction.
struct Step {
    cycles: u64,
    /// Word address of the next one.
    next: u32,
}

impl Now {
    fn load(cpu: Cpu) -> Self {
        let CoreState { pc, cycle, stop, status } = cpu.core_state();
        Self { pc: pc / 2, cycle, stop, status: Status(status) }
    }

    fn store(self, cpu: Cpu) {
        let Self { pc, cycle, stop, status: Status(status) } = self;
        cpu.set_core_state(CoreState { pc: pc << 1, cycle, stop, status });
    }
}

/// A core between two calls into simavr.
struct Core<'a> {
    cpu: Cpu,
    registers: &'a [Cell<u8>; 32],
    /// The whole data space.
    data: &'a [Cell<u8>],
    /// First address of SRAM.
    ram_start: u16,
    /// Bytes of a return address.
    return_address: u8,
}

impl Core<'_> {
    fn run(&self, now: &mut Now, program: &[Instruction]) -> bool {
        while let Some(&instruction) = program.get(now.pc as usize) {
            let Some(Step { cycles, next }) = self.execute(now, instruction) else { return false };
            now.cycle += cycles;
            now.pc = next;
            if now.cycle >= now.stop {
                return true;
            }
        }
        false
    }

    /// Executes an instruction. `None`: it was left undone, for simavr to do.
    #[inline(always)]
    fn execute(&self, now: &mut Now, instruction: Instruction) -> Option<Step> {
        let mut cycles = 1;
        let mut next = now.pc.wrapping_add(1);
        match instruction {
            Instruction::Nop => {}
            Instruction::Mov { to, from } => self.set(to, self.get(from)),
            Instruction::Movw { to, from } => self.set_pair(to, self.pair(from)),
            Instruction::Ldi { to, value } => self.set(to, value),
            Instruction::Add { to, from } => self.set(to, now.status.add(self.get(to), self.get(from), 0)),
            Instruction::Adc { to, from } => {
                let carry = now.status.carry();
                self.set(to, now.status.add(self.get(to), self.get(from), carry));
            }
            Instruction::Sub { to, from } => self.set(to, now.status.subtract(self.get(to), self.get(from))),
            Instruction::Subi { to, value } => self.set(to, now.status.subtract(self.get(to), value)),
            Instruction::Sbc { to, from } => {
                self.set(to, now.status.subtract_with_carry(self.get(to), self.get(from)));
            }
            Instruction::Sbci { to, value } => {
                self.set(to, now.status.subtract_with_carry(self.get(to), value))
            }
            Instruction::Cp { one, other } => drop(now.status.subtract(self.get(one), self.get(other))),
            Instruction::Cpi { one, value } => drop(now.status.subtract(self.get(one), value)),
            Instruction::Cpc { one, other } => {
                now.status.subtract_with_carry(self.get(one), self.get(other));
            }
            Instruction::And { to, from } => self.logic(now, to, self.get(to) & self.get(from)),
            Instruction::Or { to, from } => self.logic(now, to, self.get(to) | self.get(from)),
            Instruction::Eor { to, from } => self.logic(now, to, self.get(to) ^ self.get(from)),
            Instruction::Andi { to, value } => self.logic(now, to, self.get(to) & value),
            Instruction::Ori { to, value } => self.logic(now, to, self.get(to) | value),
            Instruction::Com { to } => {
                self.logic(now, to, !self.get(to));
                now.status.set(status::CARRY, true);
            }
            Instruction::Neg { to } => {
                let value = self.get(to);
                let result = value.wrapping_neg();
                now.status.negate(value, result);
                self.set(to, result);
            }
            Instruction::Inc { to } => {
                let result = self.get(to).wrapping_add(1);
                now.status.result(result, result == 0x80);
                self.set(to, result);
            }
            Instruction::Dec { to } => {
                let result = self.get(to).wrapping_sub(1);
                now.status.result(result, result == 0x7f);
                self.set(to, result);
            }
            Instruction::Swap { to } => self.set(to, self.get(to).rotate_left(4)),
            Instruction::Lsr { to } => self.shift(now, to, 0),
            Instruction::Asr { to } => self.shift(now, to, self.get(to) & 0x80),
            Instruction::Ror { to } => self.shift(now, to, now.status.carry() << 7),
            Instruction::Adiw { to, value } => {
                let word = self.pair(to);
                let result = word.wrapping_add(value.into());
                now.status.word(result, !result & word & 0x8000 != 0, !word & result & 0x8000 != 0);
                self.set_pair(to, result);
                cycles = 2;
            }
            Instruction::Sbiw { to, value } => {
                let word = self.pair(to);
                let result = word.wrapping_sub(value.into());
                now.status.word(result, !word & result & 0x8000 != 0, !result & word & 0x8000 != 0);
                self.set_pair(to, result);
                cycles = 2;
            }
            Instruction::Mul { one, other } => {
                self.product(now, u16::from(self.get(one)) * u16::from(self.get(other)));
                cycles = 2;
            }
            Instruction::Muls { one, other } => {
                self.product(now, (self.signed(one) * self.signed(other)) as u16);
                cycles = 2;
            }
            Instruction::Mulsu { one, other } => {
                self.product(now, (self.signed(one) * i16::from(self.get(other))) as u16);
                cycles = 2;
            }
            Instruction::Bst { from, mask } => now.status.set(TRANSFER, self.get(from) & mask != 0),
            Instruction::Bld { to, mask } => {
                let bit = if now.status.has(TRANSFER) { mask } else { 0 };
                self.set(to, self.get(to) & !mask | bit);
            }
            Instruction::Bset { mask } => now.status.set(mask, true),
            Instruction::Bclr { mask } => now.status.set(mask, false),
            Instruction::Sei => self.set_status(now, Status(now.status.0 | INTERRUPT)),
            Instruction::Cli => now.status.set(INTERRUPT, false),
            Instruction::Ldd { to, pointer, displacement } => {
                let value = self.load(now, self.pair(pointer).wrapping_add(displacement.into()))?;
                self.set(to, value);
                cycles = 2;
            }
            Instruction::Std { from, pointer, displacement } => {
                self.store(now, self.pair(pointer).wrapping_add(displacement.into()), self.get(from))?;
                cycles = 2;
            }
            Instruction::LdIncrement { to, pointer } => {
                let address = self.pair(pointer);
                let value = self.load(now, address)?;
                self.set_pair(pointer, address.wrapping_add(1));
                self.set(to, value);
                cycles = 2;
            }
            Instruction::StIncrement { from, pointer } => {
                let address = self.pair(pointer);
                self.store(now, address, self.get(from))?;
                self.set_pair(pointer, address.wrapping_add(1));
                cycles = 2;
            }
            Instruction::LdDecrement { to, pointer } => {
                let address = self.pair(pointer).wrapping_sub(1);
                let value = self.load(now, address)?;
                self.set_pair(pointer, address);
                self.set(to, value);
                cycles = 2;
            }
            Instruction::StDecrement { from, pointer } => {
                let address = self.pair(pointer).wrapping_sub(1);
                self.store(now, address, self.get(from))?;
                self.set_pair(pointer, address);
                cycles = 2;
            }
            Instruction::Lds { to, address } => {
                let value = self.load(now, address)?;
                self.set(to, value);
                (cycles, next) = (2, now.pc.wrapping_add(2));
            }
            Instruction::Sts { from, address } => {
                self.store(now, address, self.get(from))?;
                (cycles, next) = (2, now.pc.wrapping_add(2));
            }
            Instruction::In { to, address } => {
                let value = self.load_io(now, address.into())?;
                self.set(to, value);
            }
            Instruction::Out { from, address } => self.store_io(now, address.into(), self.get(from))?,
            Instruction::Sbi { address, mask } => {
                self.change_bit(now, address.into(), |value| value | mask)?;
                cycles = 2;
            }
            Instruction::Cbi { address, mask } => {
                self.change_bit(now, address.into(), |value| value & !mask)?;
                cycles = 2;
            }
            Instruction::Push { from } => {
                let stack = self.stack_pointer();
                self.ram(stack)?.set(self.get(from));
                self.set_stack_pointer(stack.wrapping_sub(1));
                cycles = 2;
            }
            Instruction::Pop { to } => {
                let stack = self.stack_pointer().wrapping_add(1);
                let value = self.ram(stack)?.get();
                self.set_stack_pointer(stack);
                self.set(to, value);
                cycles = 2;
            }
            Instruction::Lpm { to } => {
                let value = self.cpu.read_flash(self.pair(Z))?;
                self.set(to, value);
                cycles = 3;
            }
            Instruction::LpmIncrement { to } => {
                let address = self.pair(Z);
                let value = self.cpu.read_flash(address)?;
                self.set(to, value);
                self.set_pair(Z, address.wrapping_add(1));
                cycles = 3;
            }
            Instruction::Rjmp { to } => (cycles, next) = (2, to),
            Instruction::Jmp { to } => (cycles, next) = (3, to),
            Instruction::Ijmp => (cycles, next) = (2, self.pair(Z).into()),
            Instruction::Rcall { to } => {
                self.push_address(next)?;
                (cycles, next) = (1 + u64::from(self.return_address), to);
            }
            Instruction::Icall => {
                self.push_address(next)?;
                (cycles, next) = (1 + u64::from(self.return_address), self.pair(Z).into());
            }
            Instruction::Call { to } => {
                self.push_address(now.pc.wrapping_add(2))?;
                (cycles, next) = (2 + u64::from(self.return_address), to);
            }
            Instruction::Ret => {
                next = self.pop_address()?;
                cycles = 2 + u64::from(self.return_address);
            }
            Instruction::Reti => {
                next = self.pop_address()?;
                cycles = 2 + u64::from(self.return_address);
                self.set_status(now, Status(now.status.0 | INTERRUPT));
            }
            Instruction::Brbs { mask, to } => {
                if now.status.has(mask) {
                    (cycles, next) = (2, to);
                }
            }
            Instruction::Brbc { mask, to } => {
                if !now.status.has(mask) {
                    (cycles, next) = (2, to);
                }
            }
            Instruction::Cpse { one, other, skip } => {
                let words = if self.get(one) == self.get(other) { skip } else { 0 };
                (cycles, next) = (1 + u64::from(words), next.wrapping_add(words.into()));
            }
            Instruction::Sbrs { from, mask, skip } => {
                let words = if self.get(from) & mask != 0 { skip } else { 0 };
                (cycles, next) = (1 + u64::from(words), next.wrapping_add(words.into()));
            }
            Instruction::Sbrc { from, mask, skip } => {
                let words = if self.get(from) & mask == 0 { skip } else { 0 };
                (cycles, next) = (1 + u64::from(words), next.wrapping_add(words.into()));
            }
            Instruction::Sbis { address, mask, skip } => {
                let words = if self.load_io(now, address.into())? & mask != 0 { skip } else { 0 };
                (cycles, next) = (1 + u64::from(words), next.wrapping_add(words.into()));
            }
            Instruction::Sbic { address, mask, skip } => {
                let words = if self.load_io(now, address.into())? & mask == 0 { skip } else { 0 };
                (cycles, next) = (1 + u64::from(words), next.wrapping_add(words.into()));
            }
            Instruction::Other => return None,
        }
        Some(Step { cycles, next })
    }

    // --- Registers ------------------------------------------------------------------------------

    fn get(&self, register: u8) -> u8 {
        self.registers[usize::from(register & 0x1f)].get()
    }

    fn set(&self, register: u8, value: u8) {
        self.registers[usize::from(register & 0x1f)].set(value);
    }

    fn signed(&self, register: u8) -> i16 {
        (self.get(register) as i8).into()
    }

    fn pair(&self, register: u8) -> u16 {
        u16::from_le_bytes([self.get(register), self.get(register + 1)])
    }

    fn set_pair(&self, register: u8, value: u16) {
        let [low, high] = value.to_le_bytes();
        self.set(register, low);
        self.set(register + 1, high);
    }

    fn logic(&self, now: &mut Now, to: u8, result: u8) {
        now.status.logic(result);
        self.set(to, result);
    }

    /// Shifts a register right, with `highest` as its new highest bit.
    fn shift(&self, now: &mut Now, to: u8, highest: u8) {
        let value = self.get(to);
        let result = value >> 1 | highest;
        now.status.shift(result, value & 1);
        self.set(to, result);
    }

    fn product(&self, now: &mut Now, product: u16) {
        now.status.product(product);
        self.set_pair(0, product);
    }

    /// Sets SREG. The run ends where that enables interrupts.
    fn set_status(&self, now: &mut Now, status: Status) {
        if status.has(INTERRUPT) && !now.status.has(INTERRUPT) {
            self.cpu.enable_interrupts();
            now.stop = now.cycle;
        }
        now.status = status;
    }

    // --- Memory ---------------------------------------------------------------------------------

    /// A place in SRAM.
    fn ram(&self, address: u16) -> Option<&Cell<u8>> {
        self.data.get(usize::from(address)).filter(|_| address >= self.ram_start)
    }

    fn load(&self, now: &mut Now, address: u16) -> Option<u8> {
        if address >= self.ram_start {
            self.data.get(usize::from(address)).map(Cell::get)
        } else if address < IO_START {
            Some(self.get(address as u8))
        } else {
            self.load_io(now, address)
        }
    }

    fn store(&self, now: &mut Now, address: u16, value: u8) -> Option<()> {
        if address >= self.ram_start {
            self.data.get(usize::from(address))?.set(value);
            Some(())
        } else if address < IO_START {
            self.set(address as u8, value);
            Some(())
        } else {
            self.store_io(now, address, value)
        }
    }

    fn load_io(&self, now: &mut Now, address: u16) -> Option<u8> {
        let register = self.data.get(usize::from(address))?;
        if address == SREG {
            register.set(now.status.0);
        }
        match self.cpu.read_access(address) {
            Access::Plain => Some(register.get()),
            Access::Handled => {
                let value;
                (*now, value) = self.read_handled(*now, address);
                Some(value)
            }
            Access::Special => None,
        }
    }

    fn store_io(&self, now: &mut Now, address: u16, value: u8) -> Option<()> {
        let register = self.data.get(usize::from(address))?;
        match self.cpu.write_access(address) {
            Access::Plain if address == SREG => {
                register.set(value);
                self.set_status(now, Status(value));
            }
            Access::Plain => register.set(value),
            Access::Handled => *now = self.write_handled(*now, address, value),
            Access::Special => return None,
        }
        Some(())
    }

    /// SBI and CBI.
    fn change_bit(&self, now: &mut Now, address: u16, change: impl Fn(u8) -> u8) -> Option<()> {
        if self.cpu.has_bit_handler(address) || self.cpu.write_access(address) == Access::Special {
            return None;
        }
        let value = self.load_io(now, address)?;
        self.store_io(now, address, change(value))
    }

    /// Reads a register by its handler, which may end the run.
    #[inline(never)]
    fn read_handled(&self, now: Now, address: u16) -> (Now, u8) {
        now.store(self.cpu);
        let value = self.cpu.read_handled(address);
        (self.after_handler(now), value)
    }

    #[inline(never)]
    fn write_handled(&self, now: Now, address: u16, value: u8) -> Now {
        now.store(self.cpu);
        self.cpu.write_handled(address, value);
        self.after_handler(now)
    }

    fn after_handler(&self, now: Now) -> Now {
        let CoreState { cycle, stop, .. } = self.cpu.core_state();
        Now { cycle, stop: if self.cpu.must_pause() { cycle } else { stop }, ..now }
    }

    // --- Stack ----------------------------------------------------------------------------------

    fn stack_pointer(&self) -> u16 {
        let byte = |address| self.data.get(usize::from(address)).map_or(0, Cell::get);
        u16::from_le_bytes([byte(SPL), byte(SPH)])
    }

    fn set_stack_pointer(&self, value: u16) {
        let [low, high] = value.to_le_bytes();
        for (address, byte) in [(SPL, low), (SPH, high)] {
            if let Some(register) = self.data.get(usize::from(address)) {
                register.set(byte);
            }
        }
    }

    /// Pushes a word address, the low byte first.
    fn push_address(&self, address: u32) -> Option<()> {
        let mut stack = self.stack_pointer();
        for byte in address.to_le_bytes().into_iter().take(self.return_address.into()) {
            self.ram(stack)?.set(byte);
            stack = stack.wrapping_sub(1);
        }
        self.set_stack_pointer(stack);
        Some(())
    }

    fn pop_address(&self) -> Option<u32> {
        let mut stack = self.stack_pointer();
        let mut address = 0;
        for _ in 0..self.return_address {
            stack = stack.wrapping_add(1);
            address = address << 8 | u32::from(self.ram(stack)?.get());
        }
        self.set_stack_pointer(stack);
        Some(address)
    }
}

#[cfg(test)]
mod tests;
