//! Machine code, as far as it matters to a stack (AVR Instruction Set Manual).

/// An instruction. Registers are given by number, addresses in bytes of flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction {
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

use Instruction::*;

/// A byte of the stack pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Half {
    Low,
    High,
}

/// SPL, SPH and SREG, as I/O registers. In the data space they lie 0x20 higher.
const STACK_POINTER: [(u16, Half); 2] = [(0x3d, Half::Low), (0x3e, Half::High)];
const STATUS: u16 = 0x3f;

const NOTHING: Instruction = Other(0);

/// Registers that instructions change besides the one they name.
const PRODUCT: u32 = 0b11;
const X: u32 = 0b11 << 26;
const Y: u32 = 0b11 << 28;
const Z: u32 = 0b11 << 30;

/// The instruction at an address, and its length in bytes. `None` where there is none of the classic AVR.
pub fn decode(flash: &[u8], address: u32) -> Option<(Instruction, u32)> {
    let first = word(flash, address)?;
    let second = word(flash, address + 2);
    let on_pair = |second| subtraction(first, second).or_else(|| comparison(first, second));
    if let Some(on_pair) = second.and_then(on_pair) {
        return Some((on_pair, 4));
    }
    Some(match length(first) {
        2 => (one_word(first, address + 2)?, 2),
        length => (two_words(first, second?), length),
    })
}

/// How many bytes a skip passes over: one instruction at this address.
pub fn skipped(flash: &[u8], address: u32) -> u32 {
    word(flash, address).map_or(0, length)
}

/// Of the instruction that begins with this word, in bytes.
fn length(word: u16) -> u32 {
    if is_jump_or_call(word) || is_direct(word) { 4 } else { 2 }
}

/// The word at an address.
pub fn word(flash: &[u8], address: u32) -> Option<u16> {
    let bytes = flash.get(address as usize..)?.first_chunk()?;
    Some(u16::from_le_bytes(*bytes))
}

fn is_jump_or_call(word: u16) -> bool {
    word & 0xfe0c == 0x940c
}

/// `lds` or `sts`.
fn is_direct(word: u16) -> bool {
    word & 0xfc0f == 0x9000
}

/// `subi` and `sbci` on a pair of registers.
fn subtraction(first: u16, second: u16) -> Option<Instruction> {
    let [low, high] = [first, second].map(upper_register);
    let is_pair = first >> 12 == 5 && second >> 12 == 4 && low.is_multiple_of(2) && high == low + 1;
    let amount = i16::from_le_bytes([first, second].map(immediate));
    is_pair.then_some(AddPair(low, amount.wrapping_neg()))
}

/// `cpi` and `cpc` on a pair of registers.
fn comparison(first: u16, second: u16) -> Option<Instruction> {
    let (low, high, with) = (upper_register(first), register(second), second_register(second));
    let is_pair = first >> 12 == 3 && second >> 10 == 1 && low.is_multiple_of(2) && high == low + 1;
    is_pair.then_some(ComparePair(low, immediate(first), with))
}

fn two_words(first: u16, second: u16) -> Instruction {
    if is_jump_or_call(first) {
        let high = u32::from(first >> 3 & 0x3e | first & 1);
        let target = (high << 16 | u32::from(second)) * 2;
        return if first & 2 == 0 { Jump(target) } else { Call(target) };
    }
    let address = second.wrapping_sub(0x20);
    if first & 0x200 == 0 {
        return if address == STATUS { ReadStatus(register(first)) } else { changes(first) };
    }
    written(address, register(first))
}

/// A write of a register to this address among the I/O registers.
fn written(address: u16, from: u8) -> Instruction {
    match stack_pointer(address) {
        Some(half) => WriteStackPointer(half, from),
        None if address == STATUS => WriteStatus(from),
        None => NOTHING,
    }
}

fn one_word(word: u16, next: u32) -> Option<Instruction> {
    let instruction = match (word >> 12, word >> 8 & 0xf) {
        (0x0, 0x0) => return (word == 0).then_some(NOTHING),
        (0x0, 0x1) => CopyPair((word >> 3 & 0x1e) as u8, (word << 1 & 0x1e) as u8),
        (0x0, 0x2..=0x3) => Other(PRODUCT),
        (0x0 | 0x1, 0x4..=0x7) | (0x3, _) => NOTHING, // comparisons
        (0x1, 0x0..=0x3) => Skip,
        (0x2, 0xc..) => Copy(register(word), second_register(word)),
        (0x0..=0x2, _) => changes(word),
        (0x4..=0x7, _) => Other(1 << upper_register(word)),
        (0x8 | 0xa, _) if word & 0x200 != 0 => NOTHING, // std
        (0x8 | 0xa, _) if word & 8 != 0 => LoadAboveY(register(word), displacement(word)),
        (0x8 | 0xa, _) => changes(word), // ldd from Z
        (0x9, 0x0..=0x3) => return transfer(word),
        (0x9, 0x4..=0x5) => return operation(word),
        (0x9, kind @ 0x6..=0x7) => {
            let amount = (word >> 2 & 0x30 | word & 0xf) as i16;
            AddPair((word >> 3 & 0x6) as u8 + 24, if kind == 6 { amount } else { -amount })
        }
        (0x9, 0x8 | 0xa) => NOTHING, // cbi, sbi
        (0x9, 0x9 | 0xb) => Skip,
        (0x9, _) => Other(PRODUCT),
        (0xb, kind) => {
            let address = word >> 5 & 0x30 | word & 0xf;
            match stack_pointer(address) {
                _ if kind >= 8 => written(address, register(word)),
                Some(half) => ReadStackPointer(half, register(word)),
                None if address == STATUS => ReadStatus(register(word)),
                None => changes(word),
            }
        }
        (0xc, _) => Jump(relative(next, word, 12)),
        (0xd, _) => Call(relative(next, word, 12)),
        (0xe, _) => Load(upper_register(word), immediate(word)),
        (0xf, 0x4..=0x7) if word & 7 == 0 => BranchIfSameOrHigher(relative(next, word >> 3, 7)),
        (0xf, 0x0..=0x7) => Branch(relative(next, word >> 3, 7)),
        (_, _) if word & 8 != 0 => return None,
        (_, 0x8..=0x9) => changes(word), // bld
        (_, 0xa..=0xb) => NOTHING,       // bst
        (_, _) => Skip,
    };
    Some(instruction)
}

/// Loads and stores by a pointer, `push` and `pop`.
fn transfer(word: u16) -> Option<Instruction> {
    let is_load = word & 0x200 == 0;
    let pointer = match word & 0xf {
        0x1 | 0x2 => Z,
        0x4 | 0x6 if is_load => 0, // lpm, elpm
        0x5 | 0x7 if is_load => Z,
        0x9 | 0xa => Y,
        0xc => 0,
        0xd | 0xe => X,
        0xf => return Some(if is_load { Pop(register(word)) } else { Push(register(word)) }),
        _ => return None,
    };
    Some(Other(pointer | if is_load { 1 << register(word) } else { 0 }))
}

/// What has one operand or none.
fn operation(word: u16) -> Option<Instruction> {
    match (word & 0xf, word) {
        (0x0..=0x3 | 0x5..=0x7 | 0xa, _) => Some(changes(word)),
        (_, 0x9409 | 0x9419) => Some(JumpIndirect),
        (_, 0x9509 | 0x9519) => Some(CallIndirect),
        (_, 0x9508 | 0x9518) => Some(Return),
        (_, 0x95c8 | 0x95d8) => Some(Other(1)), // lpm, elpm
        (_, 0x9478) => Some(EnableInterrupts),
        (_, 0x94f8) => Some(DisableInterrupts),
        (0x8, ..0x9500) | (_, 0x9588 | 0x9598 | 0x95a8 | 0x95e8) => Some(NOTHING), // flags, sleep, break, wdr, spm
        _ => None,
    }
}

fn stack_pointer(address: u16) -> Option<Half> {
    STACK_POINTER.iter().find(|(at, _)| *at == address).map(|&(_, half)| half)
}

/// Changes the register it names.
fn changes(word: u16) -> Instruction {
    Other(1 << register(word))
}

fn register(word: u16) -> u8 {
    (word >> 4 & 0x1f) as u8
}

/// The other of two registers.
fn second_register(word: u16) -> u8 {
    (word >> 5 & 0x10 | word & 0xf) as u8
}

/// Of an instruction with an immediate value, which reaches registers 16 to 31 only.
fn upper_register(word: u16) -> u8 {
    (word >> 4 & 0xf) as u8 + 16
}

fn immediate(word: u16) -> u8 {
    (word >> 4 & 0xf0 | word & 0xf) as u8
}

/// Of `ldd`.
fn displacement(word: u16) -> u8 {
    (word >> 8 & 0x20 | word >> 7 & 0x18 | word & 7) as u8
}

/// A distance in words, in the lowest so many bits.
fn relative(next: u32, word: u16, bits: u32) -> u32 {
    let distance = (word << (16 - bits)).cast_signed() >> (16 - bits);
    next.wrapping_add_signed(i32::from(distance) * 2)
}

#[cfg(test)]
mod tests;
