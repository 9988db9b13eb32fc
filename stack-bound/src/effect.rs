//! Instructions, as far as they matter to a stack.

use instruction_set::{
    Arithmetic, Bits, Branch, Compare, Flow, Instruction, Jump, Load, Memory, Move, Rare, Special, Stack,
    Store, Sum, Transfer, Word, Y, Z, has_two_words,
};

/// What an instruction does, or two that belong together. Registers are given by number, addresses in bytes of flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    Push(u8),
    Pop(u8),
    /// `in` from SPL or SPH.
    ReadStackPointer(Half, u8),
    /// `out` or `sts` to SPL or SPH.
    WriteStackPointer(Half, u8),
    /// `ldd`, from so many bytes above Y: to, bytes.
    LoadAboveY(u8, u8),
    /// `ldi`: to, value.
    Load(u8, u8),
    /// `mov`: to, from.
    Copy(u8, u8),
    /// `movw`: to, from, each the lower register of a pair.
    CopyPair(u8, u8),
    /// `cpi` and `cpc` in a row: the lower register of a pair, what its low byte is compared with, and the
    /// register with which its high byte is.
    ComparePair(u8, u8, u8),
    /// `in` or `lds` from SREG.
    ReadStatus(u8),
    /// `out` or `sts` to SREG.
    WriteStatus(u8),
    /// `sei`.
    EnableInterrupts,
    /// `cli`.
    DisableInterrupts,
    /// `adiw`, `sbiw`, or `subi` and `sbci` in a row: the lower register of a pair, and what is added.
    AddPair(u8, i16),
    Jump(u32),
    /// `ijmp`, `eijmp`: to where Z points.
    JumpIndirect,
    Call(u32),
    /// `icall`, `eicall`.
    CallIndirect,
    /// There, or on.
    Branch(u32),
    /// `brcc`, `brsh`: there after a comparison of unsigned numbers whose first is the same or higher, or on.
    BranchIfSameOrHigher(u32),
    /// On, or past the next instruction.
    Skip,
    /// `ret`, `reti`.
    Return,
    /// None of these. It may change the registers whose bits are set.
    Other(u32),
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

/// The flag of SREG that a comparison of unsigned numbers sets where the first is lower.
const CARRY: u8 = 1;

const NOTHING: Effect = Effect::Other(0);

/// The registers of a product.
const PRODUCT: Effect = Effect::Other(0b11);

/// What the instruction at an address does, and its length in bytes. `None` where there is none.
pub fn effect(flash: &[u8], address: u32) -> Option<(Effect, u32)> {
    let instruction = instruction(flash, address)?;
    let next = self::instruction(flash, address + 2);
    match next.and_then(|next| on_pair(instruction, next)) {
        Some(effect) => Some((effect, 4)),
        None => Some((of(instruction), length(flash, address))),
    }
}

/// The instruction at an address. `None` where there is none, or half of one.
pub fn instruction(flash: &[u8], address: u32) -> Option<Instruction> {
    let (opcode, second) = (word(flash, address)?, word(flash, address + 2));
    let is_whole = second.is_some() || !has_two_words(opcode);
    let instruction = instruction_set::decode(address / 2, opcode, second.unwrap_or(u16::MAX));
    Some(instruction).filter(|&instruction| is_whole && instruction != Instruction::NONE)
}

/// The address in the data space that the instruction at an address names: a variable's, in `lds` and `sts`,
/// or that of an I/O register, in `in` and `out`, and where a bit of it is set, cleared or asked for.
pub fn named_address(flash: &[u8], address: u32) -> Option<u16> {
    match instruction(flash, address)? {
        Instruction::Transfer(Transfer::Memory(
            Memory::Load(Load::Lds { address, .. }) | Memory::Store(Store::Sts { address, .. }),
        )) => Some(address),
        Instruction::Flow(Flow::Special(
            Special::In { address, .. }
            | Special::Out { address, .. }
            | Special::Sbi { address, .. }
            | Special::Cbi { address, .. }
            | Special::Sbis { address, .. }
            | Special::Sbic { address, .. },
        )) => Some(address.into()),
        _ => None,
    }
}

/// Of the instruction at an address, in bytes: what a skip passes over.
pub fn length(flash: &[u8], address: u32) -> u32 {
    word(flash, address).map_or(0, |opcode| if has_two_words(opcode) { 4 } else { 2 })
}

fn word(flash: &[u8], address: u32) -> Option<u16> {
    let bytes = flash.get(address as usize..)?.first_chunk()?;
    Some(u16::from_le_bytes(*bytes))
}

/// What two instructions in a row do to a pair of registers: `subi` and `sbci`, or `cpi` and `cpc`.
fn on_pair(first: Instruction, second: Instruction) -> Option<Effect> {
    let (Instruction::Arithmetic(first), Instruction::Arithmetic(second)) = (first, second) else {
        return None;
    };
    let (low, high, effect) = match (first, second) {
        (
            Arithmetic::Sum(Sum::Subi { to: low, value: amount }),
            Arithmetic::Sum(Sum::Sbci { to: high, value: high_amount }),
        ) => (low, high, Effect::AddPair(low, i16::from_le_bytes([amount, high_amount]).wrapping_neg())),
        (
            Arithmetic::Compare(Compare::Cpi { one: low, value }),
            Arithmetic::Compare(Compare::Cpc { one: high, other }),
        ) => (low, high, Effect::ComparePair(low, value, other)),
        _ => return None,
    };
    (low.is_multiple_of(2) && high == low + 1).then_some(effect)
}

fn of(instruction: Instruction) -> Effect {
    match instruction {
        Instruction::Transfer(transfer) => match transfer {
            Transfer::Move(Move::Movw { to, from }) => Effect::CopyPair(to, from),
            Transfer::Move(Move::Ldi { to, value }) => Effect::Load(to, value),
            Transfer::Move(Move::Mov { to, from }) => Effect::Copy(to, from),
            Transfer::Memory(Memory::Load(load)) => of_load(load),
            Transfer::Memory(Memory::Store(Store::Sts { from, address })) => written(address, from),
            Transfer::Memory(Memory::Store(Store::Std { .. })) => NOTHING,
            Transfer::Memory(Memory::Store(Store::StStep { pointer, .. })) => Effect::Other(pair(pointer)),
            Transfer::Stack(Stack::Push { from }) => Effect::Push(from),
            Transfer::Stack(Stack::Pop { to }) => Effect::Pop(to),
        },
        Instruction::Arithmetic(Arithmetic::Compare(_)) => NOTHING,
        Instruction::Arithmetic(Arithmetic::Sum(sum)) => match sum {
            Sum::Adiw { to, value } => Effect::AddPair(to, value.into()),
            Sum::Sbiw { to, value } => Effect::AddPair(to, -i16::from(value)),
            Sum::Subi { to, .. }
            | Sum::Sbci { to, .. }
            | Sum::Add { to, .. }
            | Sum::Adc { to, .. }
            | Sum::Sub { to, .. }
            | Sum::Sbc { to, .. } => changes(to),
        },
        Instruction::Arithmetic(Arithmetic::Bits(bits)) => of_bits(bits),
        Instruction::Flow(Flow::Branch(branch)) => match branch {
            Branch::Brbc { mask: CARRY, to } => Effect::BranchIfSameOrHigher(bytes(to)),
            Branch::Brbs { to, .. } | Branch::Brbc { to, .. } => Effect::Branch(bytes(to)),
        },
        Instruction::Flow(Flow::Jump(jump)) => match jump {
            Jump::Rjmp { to } | Jump::Jmp { to } => Effect::Jump(bytes(to)),
            Jump::Ijmp => Effect::JumpIndirect,
        },
        Instruction::Flow(Flow::Special(special)) => of_special(special),
    }
}

fn of_load(load: Load) -> Effect {
    match load {
        Load::Ldd { to, pointer: Y, displacement } => Effect::LoadAboveY(to, displacement),
        Load::Ldd { to, .. } => changes(to),
        Load::Lds { to, address: STATUS } => Effect::ReadStatus(to),
        Load::Lds { to, .. } => changes(to),
        Load::LdStep { to, pointer, .. } => Effect::Other(1 << to | pair(pointer)),
    }
}

fn of_bits(bits: Bits) -> Effect {
    match bits {
        Bits::And { to, .. }
        | Bits::Or { to, .. }
        | Bits::Eor { to, .. }
        | Bits::Andi { to, .. }
        | Bits::Ori { to, .. }
        | Bits::Com { to }
        | Bits::Neg { to }
        | Bits::Inc { to }
        | Bits::Dec { to }
        | Bits::Swap { to }
        | Bits::Asr { to }
        | Bits::Lsr { to }
        | Bits::Ror { to }
        | Bits::Bld { to, .. } => changes(to),
        Bits::Mul { .. } | Bits::Muls { .. } | Bits::Mulsu { .. } => PRODUCT,
        Bits::Bst { .. } | Bits::Bset { .. } | Bits::Bclr { .. } => NOTHING,
    }
}

fn of_special(special: Special) -> Effect {
    match special {
        Special::Rcall { to } | Special::Call { to } => Effect::Call(bytes(to)),
        Special::Icall => Effect::CallIndirect,
        Special::Ret | Special::Reti => Effect::Return,
        Special::Sbrs { .. }
        | Special::Sbrc { .. }
        | Special::Cpse { .. }
        | Special::Sbis { .. }
        | Special::Sbic { .. } => Effect::Skip,
        Special::In { to, address } => read(address.into(), to),
        Special::Out { from, address } => written(address.into(), from),
        Special::Sei => Effect::EnableInterrupts,
        Special::Cli => Effect::DisableInterrupts,
        Special::Lpm { to } => changes(to),
        Special::LpmIncrement { to } => Effect::Other(1 << to | pair(Z)),
        Special::Cbi { .. } | Special::Sbi { .. } | Special::Nop => NOTHING,
        Special::Rare(rare) => match rare {
            Rare::Elpm { to } => changes(to),
            Rare::ElpmIncrement { to } => Effect::Other(1 << to | pair(Z)),
            Rare::FractionalProduct => PRODUCT,
            Rare::Eijmp => Effect::JumpIndirect,
            Rare::Eicall => Effect::CallIndirect,
            Rare::Sleep | Rare::Wdr | Rare::Break | Rare::Spm | Rare::None => NOTHING,
        },
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
