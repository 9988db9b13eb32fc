//! The effects of instructions that matter to a stack.

use instruction_set::Instruction::{self, *};
use instruction_set::{Word, Y, Z, branch, has_two_words};

/// The effect of an instruction, or of two that belong together. Registers are given by number, addresses in
/// bytes of flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    Push(u8),
    Pop(u8),
    /// `in` from SPL or SPH.
    ReadStackPointer(Half, u8),
    /// `out` or `sts` to SPL or SPH.
    WriteStackPointer(Half, u8),
    /// `ldd` from Y plus a displacement: to, bytes above Y.
    LoadAboveY(u8, u8),
    /// `ldi`: to, value.
    Load(u8, u8),
    /// `mov`: to, from.
    Copy(u8, u8),
    /// `ori`: to, value.
    SetBits(u8, u8),
    /// `andi`: to, value.
    KeepBits(u8, u8),
    /// `movw`: to, from, each the lower register of a pair.
    CopyPair(u8, u8),
    /// `cpi` and `cpc` in a row: the lower register of a pair, the value compared with its low byte, and the
    /// register compared with its high byte.
    ComparePair(u8, u8, u8),
    /// `in` or `lds` from SREG.
    ReadStatus(u8),
    /// `out` or `sts` to SREG.
    WriteStatus(u8),
    /// `sei`.
    EnableInterrupts,
    /// `cli`.
    DisableInterrupts,
    /// `adiw`, `sbiw`, `subi` and `sbci` in a row, or `subi` and `sbc` with r1: the lower register of a pair,
    /// and the amount added.
    AddPair(u8, i16),
    /// `sub` and `sbc` in a row: the lower register of a pair, and that of the pair subtracted from it.
    SubtractPair(u8, u8),
    /// `add`, and `adc` with r1: the lower register of a pair, and the register added.
    AddByte(u8, u8),
    Jump(u32),
    /// `ijmp`, `eijmp`: to where Z points.
    JumpIndirect,
    Call(u32),
    /// `icall`, `eicall`.
    CallIndirect,
    /// A branch: there, or to the next instruction.
    Branch(u32),
    /// `brcc`, `brsh`: there if the first of two compared unsigned numbers is the same or higher, else to the
    /// next instruction.
    BranchIfSameOrHigher(u32),
    /// To the next instruction, or past it.
    Skip,
    /// `ret`, `reti`.
    Return,
    /// Any other instruction. It may change the registers whose bits are set.
    Other(u32),
}

impl Effect {
    /// Whether it changes the stack pointer by itself, or leads elsewhere than to the next instruction.
    pub fn moves(self) -> bool {
        match self {
            Effect::Push(_)
            | Effect::Pop(_)
            | Effect::Jump(_)
            | Effect::JumpIndirect
            | Effect::Call(_)
            | Effect::CallIndirect
            | Effect::Branch(_)
            | Effect::BranchIfSameOrHigher(_)
            | Effect::Skip
            | Effect::Return => true,
            Effect::ReadStackPointer(..)
            | Effect::WriteStackPointer(..)
            | Effect::LoadAboveY(..)
            | Effect::Load(..)
            | Effect::SetBits(..)
            | Effect::KeepBits(..)
            | Effect::Copy(..)
            | Effect::CopyPair(..)
            | Effect::ComparePair(..)
            | Effect::ReadStatus(_)
            | Effect::WriteStatus(_)
            | Effect::EnableInterrupts
            | Effect::DisableInterrupts
            | Effect::AddPair(..)
            | Effect::SubtractPair(..)
            | Effect::AddByte(..)
            | Effect::Other(_) => false,
        }
    }
}

/// A byte of the stack pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Half {
    Low,
    High,
}

/// SPL, SPH and SREG in the data space.
const STACK_POINTER: [(u16, Half); 2] = [(0x5d, Half::Low), (0x5e, Half::High)];
const STATUS: u16 = 0x5f;

/// The register that compilers keep 0.
pub const ZERO: u8 = 1;

/// The flag of SREG that a comparison sets if the first unsigned number is lower.
const CARRY: u8 = 1;

const NOTHING: Effect = Effect::Other(0);

/// The registers of a product.
const PRODUCT: Effect = Effect::Other(0b11);

/// The effect of the instruction at an address, and its length in bytes. `None` if there is no instruction.
pub fn effect(flash: &[u8], address: u32) -> Option<(Effect, u32)> {
    let instruction = instruction(flash, address)?;
    let next = self::instruction(flash, address + 2);
    match next.and_then(|next| on_pair(instruction, next)) {
        Some(effect) => Some((effect, 4)),
        None => Some((of(instruction, address), length(flash, address))),
    }
}

/// The instruction at an address. `None` if there is none, or only half of one.
pub fn instruction(flash: &[u8], address: u32) -> Option<Instruction> {
    let (opcode, second) = (word(flash, address)?, word(flash, address + 2));
    let is_whole = second.is_some() || !has_two_words(opcode);
    let instruction = instruction_set::decode(address / 2, opcode, second.unwrap_or(u16::MAX));
    Some(instruction).filter(|&instruction| is_whole && instruction != Invalid)
}

/// The address in the data space that the instruction at an address names: a variable's, in `lds` and `sts`,
/// or an I/O register's, in `in` and `out`, and in the instructions that set, clear or test a bit of it.
pub fn named_address(flash: &[u8], address: u32) -> Option<u16> {
    match instruction(flash, address)? {
        Lds { address, .. } | Sts { address, .. } => Some(address),
        In { address, .. }
        | Out { address, .. }
        | Sbi { address, .. }
        | Cbi { address, .. }
        | Sbis { address, .. }
        | Sbic { address, .. } => Some(address.into()),
        _ => None,
    }
}

/// The length of the instruction at an address, in bytes: a skip passes over as many.
pub fn length(flash: &[u8], address: u32) -> u32 {
    word(flash, address).map_or(0, |opcode| if has_two_words(opcode) { 4 } else { 2 })
}

fn word(flash: &[u8], address: u32) -> Option<u16> {
    let bytes = flash.get(address as usize..)?.first_chunk()?;
    Some(u16::from_le_bytes(*bytes))
}

/// The effect of two instructions in a row on a pair of registers: they add, subtract or compare.
fn on_pair(first: Instruction, second: Instruction) -> Option<Effect> {
    let (low, high, effect) = match (first, second) {
        (Subi { to: low, value: amount }, Sbci { to: high, value: high_amount }) => {
            (low, high, Effect::AddPair(low, i16::from_le_bytes([amount, high_amount]).wrapping_neg()))
        }
        (Subi { to: low, value: amount }, Sbc { to: high, from: ZERO }) => {
            (low, high, Effect::AddPair(low, -i16::from(amount)))
        }
        (Sub { to: low, from }, Sbc { to: high, from: from_high })
            if from.is_multiple_of(2) && from_high == from + 1 =>
        {
            (low, high, Effect::SubtractPair(low, from))
        }
        (Add { to: low, from }, Adc { to: high, from: ZERO }) => (low, high, Effect::AddByte(low, from)),
        (Cpi { one: low, value }, Cpc { one: high, other }) => {
            (low, high, Effect::ComparePair(low, value, other))
        }
        _ => return None,
    };
    (low.is_multiple_of(2) && high == low + 1).then_some(effect)
}

fn of(instruction: Instruction, address: u32) -> Effect {
    match instruction {
        Movw { to, from } => Effect::CopyPair(to, from),
        Ldi { to, value } => Effect::Load(to, value),
        Mov { to, from } => Effect::Copy(to, from),
        Ldd { to, pointer: Y, displacement } => Effect::LoadAboveY(to, displacement),
        Lds { to, address: STATUS } => Effect::ReadStatus(to),
        Sts { from, address } => written(address, from),
        LdStep { to, pointer, .. } => Effect::Other(1 << to | pair(pointer)),
        StStep { pointer, .. } => Effect::Other(pair(pointer)),
        Ori { to, value } => Effect::SetBits(to, value),
        Andi { to, value } => Effect::KeepBits(to, value),
        Push { from } => Effect::Push(from),
        Pop { to } => Effect::Pop(to),
        Adiw { to, value } => Effect::AddPair(to, value.into()),
        Sbiw { to, value } => Effect::AddPair(to, -i16::from(value)),
        Brbc { mask: CARRY, by } => Effect::BranchIfSameOrHigher(bytes(branch(address / 2, by))),
        Brbs { by, .. } | Brbc { by, .. } => Effect::Branch(bytes(branch(address / 2, by))),
        Rjmp { to } | Jmp { to } => Effect::Jump(bytes(to)),
        Ijmp | Eijmp => Effect::JumpIndirect,
        Rcall { to } | Call { to } => Effect::Call(bytes(to)),
        Icall | Eicall => Effect::CallIndirect,
        Ret | Reti => Effect::Return,
        Sbrs { .. } | Sbrc { .. } | Cpse { .. } | Sbis { .. } | Sbic { .. } => Effect::Skip,
        In { to, address } => read(address.into(), to),
        Out { from, address } => written(address.into(), from),
        Sei => Effect::EnableInterrupts,
        Cli => Effect::DisableInterrupts,
        LpmIncrement { to } | ElpmIncrement { to } => Effect::Other(1 << to | pair(Z)),
        Mul { .. } | Muls { .. } | Mulsu { .. } | FractionalProduct => PRODUCT,
        Ldd { to, .. }
        | Lds { to, .. }
        | Subi { to, .. }
        | Sbci { to, .. }
        | Add { to, .. }
        | Adc { to, .. }
        | Sub { to, .. }
        | Sbc { to, .. }
        | And { to, .. }
        | Or { to, .. }
        | Eor { to, .. }
        | Com { to }
        | Neg { to }
        | Inc { to }
        | Dec { to }
        | Swap { to }
        | Asr { to }
        | Lsr { to }
        | Ror { to }
        | Bld { to, .. }
        | Lpm { to }
        | Elpm { to } => changes(to),
        Std { .. } | Cpi { .. } | Cp { .. } | Cpc { .. } | Bst { .. } | Bset { .. } | Bclr { .. } => NOTHING,
        Cbi { .. } | Sbi { .. } | Nop | Sleep | Wdr | Break | Spm | Invalid => NOTHING,
    }
}

/// `in`, from a register in the data space.
fn read(address: u16, to: u8) -> Effect {
    match stack_pointer(address) {
        Some(half) => Effect::ReadStackPointer(half, to),
        None if address == STATUS => Effect::ReadStatus(to),
        None => changes(to),
    }
}

/// `out` or `sts`, to a register in the data space.
fn written(address: u16, from: u8) -> Effect {
    match stack_pointer(address) {
        Some(half) => Effect::WriteStackPointer(half, from),
        None if address == STATUS => Effect::WriteStatus(from),
        None => NOTHING,
    }
}

fn stack_pointer(address: u16) -> Option<Half> {
    STACK_POINTER.iter().find(|(at, _)| *at == address).map(|&(_, half)| half)
}

fn changes(register: u8) -> Effect {
    Effect::Other(1 << register)
}

/// Both registers of a pair.
fn pair(low: u8) -> u32 {
    0b11 << low
}

/// The address of a word, in bytes.
fn bytes(word: Word) -> u32 {
    2 * u32::from(word)
}

#[cfg(test)]
mod tests;
