//! Code in a form that does not depend on where the linker puts it.

use std::ops::Range;

use instruction_set::Instruction::{self, *};
use instruction_set::{Word, decode, has_two_words};

use super::Image;

/// An instruction of a stretch of code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// Address in bytes.
    pub address: u32,
    pub form: Form,
    pub kind: Kind,
}

/// The part of an instruction that does not depend on where the linker put the code or its symbols: opcode
/// and registers, without the values and addresses that a symbol may stand for. Near and far calls have the
/// same form, and so do near and far jumps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Form {
    opcode: u16,
    /// The target of a branch or a near jump, by its number in the stretch, if it lies in the stretch.
    target: Option<usize>,
}

/// How an instruction changes the program counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A branch on a condition.
    Branch,
    /// Skips the next instruction on a condition.
    Skip,
    /// Goes to an address from the stack or from Z: RET, RETI, IJMP, ICALL, EIJMP, EICALL.
    Indirect,
    Other,
}

/// RJMP and RCALL, without their targets.
const RJMP: u16 = 0xc000;
const RCALL: u16 = 0xd000;

impl Image {
    /// The instructions in a range of flash (byte addresses), which begins with an instruction and holds
    /// nothing else.
    pub fn code(&self, range: Range<u32>) -> Vec<Code> {
        let bytes = self.flash().get(range.start as usize..range.end as usize).unwrap_or_default();
        let words: Vec<u16> =
            bytes.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect();
        let mut starts = Vec::new();
        let mut at = 0;
        while let Some(&opcode) = words.get(at) {
            starts.push(at);
            at += if has_two_words(opcode) { 2 } else { 1 };
        }
        let first = range.start / 2;
        let number = |word: Word| starts.binary_search(&(u32::from(word).checked_sub(first)? as usize)).ok();
        let code = |&at: &usize| {
            let (word, second) = (first + at as u32, words.get(at + 1).copied().unwrap_or(u16::MAX));
            let (form, kind) = classify(words[at], decode(word, words[at], second), word, number);
            Code { address: 2 * word, form, kind }
        };
        starts.iter().map(code).collect()
    }
}

fn classify(
    opcode: u16,
    instruction: Instruction,
    at: u32,
    number: impl Fn(Word) -> Option<usize>,
) -> (Form, Kind) {
    let plain = |opcode| Form { opcode, target: None };
    let leading = |opcode| Form { opcode, target: instruction.target(at).and_then(number) };
    match instruction {
        Ldi { .. } | Subi { .. } | Sbci { .. } | Cpi { .. } => (plain(opcode & 0xf0f0), Kind::Other),
        Brbs { .. } | Brbc { .. } => (leading(opcode & 0xfc07), Kind::Branch),
        Rjmp { .. } => (leading(RJMP), Kind::Other),
        Jmp { .. } => (plain(RJMP), Kind::Other),
        Rcall { .. } | Call { .. } => (plain(RCALL), Kind::Other),
        Ijmp | Eijmp | Icall | Eicall | Ret | Reti => (plain(opcode), Kind::Indirect),
        Sbrs { .. } | Sbrc { .. } | Cpse { .. } | Sbis { .. } | Sbic { .. } => (plain(opcode), Kind::Skip),
        _ => (plain(opcode), Kind::Other),
    }
}
