//! How long instructions take (ATmega128 datasheet, "Instruction Set Summary"; AVR Instruction Set Manual).

use crate::instruction::{Instruction, decode, word};

const SLEEP: u16 = 0x9588;
const RETI: u16 = 0x9518;

/// What the instruction at an address takes, in cycles, where the next one follows: a branch that is taken
/// takes one more, and a skip one for each word that it passes over. `None` where there is no instruction,
/// and for `spm`, which takes as long as the flash does.
///
/// A call pushes `return_address` bytes.
pub fn cycles(flash: &[u8], address: u32, return_address: u16) -> Option<u32> {
    decode(flash, address)?;
    of_word(word(flash, address)?, return_address.into())
}

/// How many cycles more an instruction takes that leads to `to` rather than to the next one, at `behind`: at
/// most, for a branch that leads there either way.
pub fn more_cycles(instruction: Instruction, behind: u32, to: u32) -> u32 {
    match instruction {
        Instruction::Branch(target) | Instruction::BranchIfSameOrHigher(target) => u32::from(to == target),
        Instruction::Skip => (to - behind) / 2,
        _ => 0,
    }
}

/// Whether the core sleeps from the instruction at an address on, until an interrupt comes.
pub fn is_sleep(flash: &[u8], address: u32) -> bool {
    word(flash, address) == Some(SLEEP)
}

/// Whether that is `reti`, which enables interrupts.
pub fn is_return_from_interrupt(flash: &[u8], address: u32) -> bool {
    word(flash, address) == Some(RETI)
}

/// Of the instruction that begins with this word.
fn of_word(word: u16, return_address: u32) -> Option<u32> {
    Some(match (word >> 12, word >> 8 & 0xf) {
        (0x0, 0x2..=0x3) => 2,                                   // muls, mulsu, fmul...
        (0x8 | 0xa, _) => 2,                                     // ldd, std
        (0x9, 0x0..=0x1) if (4..8).contains(&(word & 0xf)) => 3, // lpm, elpm
        (0x9, 0x0..=0x3) => 2,                                   // lds, sts, ld, st, push, pop
        (0x9, 0x4..=0x5) => return operation(word, return_address),
        (0x9, 0x6..=0x8 | 0xa | 0xc..) => 2, // adiw, sbiw, cbi, sbi, mul
        (0xc, _) => 2,                       // rjmp
        (0xd, _) => 1 + return_address,      // rcall
        _ => 1,
    })
}

/// Of what has one operand or none.
fn operation(word: u16, return_address: u32) -> Option<u32> {
    Some(match word {
        0x9409 | 0x9419 => 2,                               // ijmp, eijmp
        0x9509 => 1 + return_address,                       // icall
        0x9519 => 4,                                        // eicall
        0x9508 | 0x9518 => 2 + return_address,              // ret, reti
        0x95c8 | 0x95d8 => 3,                               // lpm, elpm
        0x95e8 | 0x95f8 => return None,                     // spm
        _ if word & 0xfe0e == 0x940c => 3,                  // jmp
        _ if word & 0xfe0e == 0x940e => 2 + return_address, // call
        _ => 1,
    })
}
