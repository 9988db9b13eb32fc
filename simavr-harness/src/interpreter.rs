//! Executes a program on an instance of simavr faster than simavr does: instructions are decoded once for all
//! MCUs that run the program.
//!
//! It changes the instance exactly as simavr's own interpreter would, cycle by cycle. It leaves the rare
//! cases to simavr's: SLEEP, WDR, ELPM, accesses beyond memory, stores to the general registers by their
//! addresses, and invalid opcodes.

use std::cell::Cell;

use instruction_set::Instruction::{self, *};
use instruction_set::{Step, Z};

use crate::cpu::{Access, CoreState, Cpu, IO_START};
use status::{INTERRUPT, Status, TRANSFER};

mod status;

/// Data addresses of registers that the core itself uses.
const SPL: u16 = 0x5d;
const SPH: u16 = 0x5e;
const SREG: u16 = 0x5f;

/// The first number of each group of instructions; the moves come before them all.
const LOADS: u8 = Ldd { to: 0, pointer: 0, displacement: 0 }.number();
const STORES: u8 = Std { from: 0, pointer: 0, displacement: 0 }.number();
const STACK: u8 = Push { from: 0 }.number();
const COMPARISONS: u8 = Cpi { one: 0, value: 0 }.number();
const BRANCHES: u8 = Brbs { mask: 0, by: 0 }.number();
const OTHERS: u8 = Subi { to: 0, value: 0 }.number();

/// Decodes the flash word by word, because a program may jump to any word. Returns nothing for a program with
/// SPM, which may write its own flash. A jump out of the program, such as one round the end of the flash,
/// becomes `Invalid` and is left to simavr.
pub(crate) fn decode(flash: &[u8]) -> Vec<Instruction> {
    let words: Vec<u16> = flash.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect();
    let leads_out = |to| u32::from(to) as usize >= words.len();
    let followers = words.iter().skip(1).copied().chain([u16::MAX]);
    let mut program = Vec::with_capacity(words.len());
    for ((&opcode, second), at) in words.iter().zip(followers).zip(0..) {
        let instruction = instruction_set::decode(at, opcode, second);
        if instruction == Spm {
            return Vec::new();
        }
        program.push(if instruction.target(at).is_some_and(leads_out) { Invalid } else { instruction });
    }
    program
}

/// Observes executed instructions.
pub(crate) trait Note {
    /// The instruction at word `at` was executed, and the program is where `now` has it.
    fn note(&mut self, at: u32, now: &Now);
}

/// Observes nothing, at no cost.
impl Note for () {
    #[inline(always)]
    fn note(&mut self, _: u32, _: &Now) {}
}

/// Executes instructions as simavr's interpreter does, until the run ends or the next instruction is one that
/// is left to simavr. Returns whether the run has ended.
pub(crate) fn run(cpu: Cpu, program: &[Instruction], notes: &mut impl Note) -> bool {
    cpu.with_cells(|data| {
        let ram_start = cpu.ram_start();
        let ram = data.get(usize::from(ram_start)..);
        let (Some(registers), Some(ram)) = (data.first_chunk(), ram) else { return false };
        let return_address = cpu.return_address_size();
        let core = Core { cpu, registers, data, ram, ram_start, return_address };
        let mut now = Now::load(cpu);
        let ended = core.run(&mut now, program, notes);
        now.store(cpu);
        ended
    })
}

/// The state of the core that the interpreter keeps to itself during a run.
#[derive(Clone, Copy)]
pub(crate) struct Now {
    /// Word address of the instruction.
    pc: u32,
    /// Cycles from the begin of that instruction to `stop`.
    left: i64,
    /// The run ends at the first instruction boundary at or after this cycle.
    stop: u64,
    status: Status,
}

/// What an instruction took, and what follows it.
struct Done {
    cycles: i64,
    /// Word address of the next one.
    next: u32,
}

impl Now {
    pub fn load(cpu: Cpu) -> Self {
        let CoreState { pc, cycle, stop, status } = cpu.core_state();
        Self { pc: pc / 2, left: stop.wrapping_sub(cycle) as i64, stop, status: Status::of_byte(status) }
    }

    /// The outcome of an instruction of one word that does not jump.
    fn done(&self, cycles: i64) -> Option<Done> {
        Some(Done { cycles, next: self.pc.wrapping_add(1) })
    }

    pub fn cycle(self) -> u64 {
        self.stop.wrapping_sub(self.left as u64)
    }

    /// Word address of the next instruction.
    pub fn next(self) -> u32 {
        self.pc
    }

    pub fn interrupts_enabled(self) -> bool {
        self.status.has(INTERRUPT)
    }

    /// Ends the run at `stop`.
    fn stop_at(&mut self, stop: u64) {
        self.left += stop.wrapping_sub(self.stop) as i64;
        self.stop = stop;
    }

    /// Takes over the end of the run after an access to an I/O register: its handler may have halted the
    /// core, moved that end, or ended the run. `None`: the access was left undone.
    #[inline(always)]
    fn follow(&mut self, cpu: Cpu, access: Access) -> Option<()> {
        match access {
            Access::Plain => {}
            Access::Handled => (self.left, self.stop) = cpu.run_left(),
            Access::Special => return None,
        }
        Some(())
    }

    fn store(self, cpu: Cpu) {
        let Self { pc, stop, status, .. } = self;
        cpu.set_core_state(CoreState { pc: pc << 1, cycle: self.cycle(), stop, status: status.byte() });
    }
}

/// A core between two calls into simavr.
struct Core<'a> {
    cpu: Cpu,
    /// The data space up to SREG, the last of the core's own registers.
    registers: &'a [Cell<u8>; SREG as usize + 1],
    /// The whole data space.
    data: &'a [Cell<u8>],
    /// The last part of the data space, SRAM, which begins at `ram_start`.
    ram: &'a [Cell<u8>],
    ram_start: u16,
    /// Bytes of a return address.
    return_address: u8,
}

impl Core<'_> {
    fn run(&self, now: &mut Now, program: &[Instruction], notes: &mut impl Note) -> bool {
        while let Some(instruction) = program.get(now.pc as usize) {
            let Some(Done { cycles, next }) = self.execute(now, *instruction) else { return false };
            let at = std::mem::replace(&mut now.pc, next);
            now.left -= cycles;
            notes.note(at, now);
            if now.left <= 0 {
                match self.cpu.go_on(now.cycle()) {
                    Some(stop) => now.stop_at(stop),
                    None => return true,
                }
            }
        }
        false
    }

    /// Executes an instruction. `None`: it was left undone, for simavr to execute.
    ///
    /// A few branches tell the frequent groups apart: the host predicts these better than the target of a
    /// single jump through a table of all instructions.
    #[inline(always)]
    fn execute(&self, now: &mut Now, instruction: Instruction) -> Option<Done> {
        let number = instruction.number();
        if number < BRANCHES {
            if number < STACK {
                if number < LOADS {
                    self.moves(now, instruction)
                } else if number < STORES {
                    self.loads(now, instruction)
                } else {
                    self.stores(now, instruction)
                }
            } else if number < COMPARISONS {
                self.stack(now, instruction)
            } else {
                self.compare(now, instruction)
            }
        } else if number < OTHERS {
            self.branch(now, instruction)
        } else {
            self.others(now, instruction)
        }
    }

    #[inline(always)]
    fn moves(&self, now: &mut Now, instruction: Instruction) -> Option<Done> {
        match instruction {
            Movw { to, from } => self.set_pair(to, self.pair(from)),
            Ldi { to, value } => self.set(to, value),
            Mov { to, from } => self.set(to, self.get(from)),
            _ => return None,
        }
        now.done(1)
    }

    #[inline(always)]
    fn loads(&self, now: &mut Now, instruction: Instruction) -> Option<Done> {
        match instruction {
            Ldd { to, pointer, displacement } => {
                let value = self.load(now, self.pair(pointer).wrapping_add(displacement.into()))?;
                self.set(to, value);
                now.done(2)
            }
            Lds { to, address } => {
                let value = self.load(now, address)?;
                self.set(to, value);
                Some(Done { cycles: 2, next: now.pc.wrapping_add(2) })
            }
            LdStep { to, pointer, step } => {
                let (address, stepped) = self.step(pointer, step);
                let value = self.load(now, address)?;
                self.set_pair(pointer, stepped);
                self.set(to, value);
                now.done(2)
            }
            _ => None,
        }
    }

    #[inline(always)]
    fn stores(&self, now: &mut Now, instruction: Instruction) -> Option<Done> {
        match instruction {
            Std { from, pointer, displacement } => {
                self.store(now, self.pair(pointer).wrapping_add(displacement.into()), self.get(from))?;
                now.done(2)
            }
            Sts { from, address } => {
                self.store(now, address, self.get(from))?;
                Some(Done { cycles: 2, next: now.pc.wrapping_add(2) })
            }
            StStep { from, pointer, step } => {
                let (address, stepped) = self.step(pointer, step);
                self.store(now, address, self.get(from))?;
                self.set_pair(pointer, stepped);
                now.done(2)
            }
            _ => None,
        }
    }

    #[inline(always)]
    fn stack(&self, now: &mut Now, instruction: Instruction) -> Option<Done> {
        match instruction {
            Push { from } => {
                let stack = self.stack_pointer();
                self.ram(stack)?.set(self.get(from));
                self.set_stack_pointer(stack.wrapping_sub(1));
            }
            Pop { to } => {
                let stack = self.stack_pointer().wrapping_add(1);
                let value = self.ram(stack)?.get();
                self.set_stack_pointer(stack);
                self.set(to, value);
            }
            _ => return None,
        }
        now.done(2)
    }

    #[inline(always)]
    fn compare(&self, now: &mut Now, instruction: Instruction) -> Option<Done> {
        match instruction {
            Cpi { one, value } => drop(now.status.subtract(self.get(one), value)),
            Cp { one, other } => drop(now.status.subtract(self.get(one), self.get(other))),
            Cpc { one, other } => {
                now.status.subtract_with_carry(self.get(one), self.get(other));
            }
            _ => return None,
        }
        now.done(1)
    }

    #[inline(always)]
    fn others(&self, now: &mut Now, instruction: Instruction) -> Option<Done> {
        let mut cycles = 1;
        let mut next = now.pc.wrapping_add(1);
        match instruction {
            Subi { to, value } => self.set(to, now.status.subtract(self.get(to), value)),
            Sbci { to, value } => self.set(to, now.status.subtract_with_carry(self.get(to), value)),
            Adiw { to, value } => {
                let word = self.pair(to);
                let result = word.wrapping_add(value.into());
                now.status.word(result, !result & word & 0x8000 != 0, !word & result & 0x8000 != 0);
                self.set_pair(to, result);
                cycles = 2;
            }
            Sbiw { to, value } => {
                let word = self.pair(to);
                let result = word.wrapping_sub(value.into());
                now.status.word(result, !word & result & 0x8000 != 0, !result & word & 0x8000 != 0);
                self.set_pair(to, result);
                cycles = 2;
            }
            Add { to, from } => self.set(to, now.status.add(self.get(to), self.get(from), 0)),
            Adc { to, from } => {
                let carry = now.status.carry();
                self.set(to, now.status.add(self.get(to), self.get(from), carry));
            }
            Sub { to, from } => self.set(to, now.status.subtract(self.get(to), self.get(from))),
            Sbc { to, from } => {
                self.set(to, now.status.subtract_with_carry(self.get(to), self.get(from)));
            }
            And { to, from } => self.logic(now, to, self.get(to) & self.get(from)),
            Or { to, from } => self.logic(now, to, self.get(to) | self.get(from)),
            Eor { to, from } => self.logic(now, to, self.get(to) ^ self.get(from)),
            Andi { to, value } => self.logic(now, to, self.get(to) & value),
            Ori { to, value } => self.logic(now, to, self.get(to) | value),
            Com { to } => {
                self.logic(now, to, !self.get(to));
                now.status.set(status::CARRY, true);
            }
            Neg { to } => {
                let value = self.get(to);
                let result = value.wrapping_neg();
                now.status.negate(value, result);
                self.set(to, result);
            }
            Inc { to } => {
                let result = self.get(to).wrapping_add(1);
                now.status.result(result, result == 0x80);
                self.set(to, result);
            }
            Dec { to } => {
                let result = self.get(to).wrapping_sub(1);
                now.status.result(result, result == 0x7f);
                self.set(to, result);
            }
            Swap { to } => self.set(to, self.get(to).rotate_left(4)),
            Asr { to } => self.shift(now, to, self.get(to) & 0x80),
            Lsr { to } => self.shift(now, to, 0),
            Ror { to } => self.shift(now, to, now.status.carry() << 7),
            Mul { one, other } => {
                self.product(now, u16::from(self.get(one)) * u16::from(self.get(other)));
                cycles = 2;
            }
            Muls { one, other } => {
                self.product(now, (self.signed(one) * self.signed(other)) as u16);
                cycles = 2;
            }
            Mulsu { one, other } => {
                self.product(now, (self.signed(one) * i16::from(self.get(other))) as u16);
                cycles = 2;
            }
            Bst { from, mask } => now.status.set(TRANSFER, self.get(from) & mask != 0),
            Bld { to, mask } => {
                let bit = if now.status.has(TRANSFER) { mask } else { 0 };
                self.set(to, self.get(to) & !mask | bit);
            }
            Bset { mask } => now.status.set(mask, true),
            Bclr { mask } => now.status.set(mask, false),
            Rjmp { to } => (cycles, next) = (2, to.into()),
            Jmp { to } => (cycles, next) = (3, to.into()),
            Ijmp => (cycles, next) = (2, self.pair(Z).into()),
            Rcall { to } => {
                self.push_address(next)?;
                (cycles, next) = (1 + i64::from(self.return_address), to.into());
            }
            Call { to } => {
                self.push_address(now.pc.wrapping_add(2))?;
                (cycles, next) = (2 + i64::from(self.return_address), to.into());
            }
            Icall => {
                self.push_address(next)?;
                (cycles, next) = (1 + i64::from(self.return_address), self.pair(Z).into());
            }
            Ret => {
                next = self.pop_address()?;
                cycles = 2 + i64::from(self.return_address);
            }
            Sbrs { from, mask, skip } => {
                let words = if self.get(from) & mask != 0 { skip } else { 0 };
                (cycles, next) = (1 + i64::from(words), next.wrapping_add(words.into()));
            }
            Sbrc { from, mask, skip } => {
                let words = if self.get(from) & mask == 0 { skip } else { 0 };
                (cycles, next) = (1 + i64::from(words), next.wrapping_add(words.into()));
            }
            Cpse { one, other, skip } => {
                let words = if self.get(one) == self.get(other) { skip } else { 0 };
                (cycles, next) = (1 + i64::from(words), next.wrapping_add(words.into()));
            }
            Sbis { address, mask, skip } => {
                let words = if self.load_io(now, address.into())? & mask != 0 { skip } else { 0 };
                (cycles, next) = (1 + i64::from(words), next.wrapping_add(words.into()));
            }
            Sbic { address, mask, skip } => {
                let words = if self.load_io(now, address.into())? & mask == 0 { skip } else { 0 };
                (cycles, next) = (1 + i64::from(words), next.wrapping_add(words.into()));
            }
            In { to, address } => {
                let value = self.load_io(now, address.into())?;
                self.set(to, value);
            }
            Out { from, address } => self.store_io(now, address.into(), self.get(from))?,
            Cbi { address, mask } => {
                self.change_bit(now, address.into(), |value| value & !mask)?;
                cycles = 2;
            }
            Sbi { address, mask } => {
                self.change_bit(now, address.into(), |value| value | mask)?;
                cycles = 2;
            }
            Sei => self.set_status(now, now.status.byte() | INTERRUPT),
            Cli => now.status.set(INTERRUPT, false),
            Reti => {
                next = self.pop_address()?;
                cycles = 2 + i64::from(self.return_address);
                self.set_status(now, now.status.byte() | INTERRUPT);
            }
            Lpm { to } => {
                let value = self.cpu.read_flash(self.pair(Z));
                self.set(to, value);
                cycles = 3;
            }
            LpmIncrement { to } => {
                let address = self.pair(Z);
                let value = self.cpu.read_flash(address);
                self.set(to, value);
                self.set_pair(Z, address.wrapping_add(1));
                cycles = 3;
            }
            Nop => {}
            _ => return None,
        }
        Some(Done { cycles, next })
    }

    #[inline(always)]
    fn branch(&self, now: &Now, instruction: Instruction) -> Option<Done> {
        let mut cycles = 1;
        let mut next = now.pc.wrapping_add(1);
        match instruction {
            Brbs { mask, by } => {
                if now.status.has(mask) {
                    (cycles, next) = (2, next.wrapping_add_signed(by.into()));
                }
            }
            Brbc { mask, by } => {
                if !now.status.has(mask) {
                    (cycles, next) = (2, next.wrapping_add_signed(by.into()));
                }
            }
            _ => return None,
        }
        Some(Done { cycles, next })
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

    /// Sets SREG.
    fn set_status(&self, now: &mut Now, status: u8) {
        let status = Status::of_byte(status);
        if status.has(INTERRUPT) && !now.status.has(INTERRUPT) {
            self.cpu.enable_interrupts();
            now.stop_at(now.cycle());
        }
        now.status = status;
    }

    // --- Memory ---------------------------------------------------------------------------------

    /// The byte of SRAM at `address`; `None` outside of SRAM.
    fn ram(&self, address: u16) -> Option<&Cell<u8>> {
        self.ram.get(usize::from(address.wrapping_sub(self.ram_start)))
    }

    #[inline(always)]
    fn load(&self, now: &mut Now, address: u16) -> Option<u8> {
        match self.ram(address) {
            Some(place) => Some(place.get()),
            None if address < IO_START => Some(self.get(address as u8)),
            None => self.load_io(now, address),
        }
    }

    #[inline(always)]
    fn store(&self, now: &mut Now, address: u16, value: u8) -> Option<()> {
        match self.ram(address) {
            Some(place) => place.set(value),
            // A general register: where `st X` has written X itself, simavr writes the old X back.
            None if address < IO_START => return None,
            None => self.store_io(now, address, value)?,
        }
        Some(())
    }

    #[inline(always)]
    fn load_io(&self, now: &mut Now, address: u16) -> Option<u8> {
        let (access, value) = self.read_io(*now, address);
        now.follow(self.cpu, access)?;
        Some(value)
    }

    #[inline(always)]
    fn store_io(&self, now: &mut Now, address: u16, value: u8) -> Option<()> {
        let access = self.write_io(*now, address, value);
        now.follow(self.cpu, access)?;
        if address == SREG {
            self.set_status(now, value);
        }
        Some(())
    }

    /// Not inlined, and handed a copy of `now`, so that the data of each instruction stay in the host's
    /// registers.
    #[inline(never)]
    fn read_io(&self, now: Now, address: u16) -> (Access, u8) {
        let Some(register) = self.data.get(usize::from(address)) else { return (Access::Special, 0) };
        if address == SREG {
            register.set(now.status.byte());
        }
        let access = self.cpu.read_access(address);
        let value = if access == Access::Handled {
            now.store(self.cpu);
            self.cpu.read_handled(address)
        } else {
            register.get()
        };
        (access, value)
    }

    /// Not inlined, for the same reason as `read_io`.
    #[inline(never)]
    fn write_io(&self, now: Now, address: u16, value: u8) -> Access {
        let Some(register) = self.data.get(usize::from(address)) else { return Access::Special };
        let access = self.cpu.write_access(address);
        match access {
            Access::Plain => register.set(value),
            Access::Handled => {
                now.store(self.cpu);
                self.cpu.write_handled(address, value);
            }
            Access::Special => {}
        }
        access
    }

    /// The address that a stepping pointer accesses, and the pointer's value afterwards.
    fn step(&self, pointer: u8, step: Step) -> (u16, u16) {
        let value = self.pair(pointer);
        match step {
            Step::On => (value, value.wrapping_add(1)),
            Step::Back => (value.wrapping_sub(1), value.wrapping_sub(1)),
        }
    }

    /// SBI and CBI.
    fn change_bit(&self, now: &mut Now, address: u16, change: impl Fn(u8) -> u8) -> Option<()> {
        if self.cpu.has_bit_handler(address) || self.cpu.write_access(address) == Access::Special {
            return None;
        }
        let value = self.load_io(now, address)?;
        self.store_io(now, address, change(value))
    }

    // --- Stack ----------------------------------------------------------------------------------

    fn stack_pointer(&self) -> u16 {
        u16::from_le_bytes([SPL, SPH].map(|address| self.registers[usize::from(address)].get()))
    }

    fn set_stack_pointer(&self, value: u16) {
        let [low, high] = value.to_le_bytes();
        self.registers[usize::from(SPL)].set(low);
        self.registers[usize::from(SPH)].set(high);
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
