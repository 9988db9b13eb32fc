//! Code as it is wherever the linker puts it.

use std::ops::Range;

use super::Image;
use crate::interpreter::instruction::{
    Arithmetic, Branch, Compare, Flow, Instruction, Jump, Move, Special, Sum, Transfer, has_two_words,
    instruction,
};

/// An instruction of a stretch of code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// Address in bytes.
    pub address: u32,
    pub form: Form,
    pub kind: Kind,
}

/// What of an instruction does not depend on where the linker put the code and what it refers to: opcode and
/// registers, without the values and addresses that a symbol may stand for. A call has one form whether it is
/// near or far, and so has a jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Form {
    opcode: u16,
    /// The instruction to which a branch or a jump leads, by its number in the stretch, if it leads there.
    target: Option<usize>,
}

/// What an instruction does to the program counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A branch on a condition.
    Branch,
    /// Skips the next instruction on a condition.
    Skip,
    /// Goes on where the stack or Z says: RET, RETI, IJMP, ICALL, EIJMP, EICALL.
    Indirect,
    Other,
}

/// The word at which the stretch is decoded, so that relative jumps to both sides stay in range.
const BASE: usize = 0x4000;

/// RJMP and RCALL, without their targets.
const RJMP: u16 = 0xc000;
const RCALL: u16 = 0xd000;

/// Which the interpreter leaves to simavr.
const EIJMP: u16 = 0x9419;
const EICALL: u16 = 0x9519;

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
        let number = |word: u16| starts.binary_search(&usize::from(word).checked_sub(BASE)?).ok();
        let code = |&at: &usize| {
            let (form, kind) = classify(words[at], decode(&words, at), number);
            Code { address: range.start + 2 * at as u32, form, kind }
        };
        starts.iter().map(code).collect()
    }
}

/// The instruction at word `at`; an absolute target is left out, for it may lie anywhere.
fn decode(words: &[u16], at: usize) -> Instruction {
    let (opcode, second) = (words[at], words.get(at + 1).copied().unwrap_or(u16::MAX));
    let (opcode, second) = if is_jump_or_call(opcode) { (opcode & 0xfe0e, 0) } else { (opcode, second) };
    instruction(BASE + at, opcode, second, usize::from(u16::MAX))
}

/// Of two words.
fn is_jump_or_call(opcode: u16) -> bool {
    opcode & 0xfe0c == 0x940c
}

fn classify(opcode: u16, instruction: Instruction, number: impl Fn(u16) -> Option<usize>) -> (Form, Kind) {
    let plain = |opcode| (Form { opcode, target: None }, Kind::Other);
    let indirect = (Form { opcode, target: None }, Kind::Indirect);
    match instruction {
        Instruction::Transfer(Transfer::Move(Move::Ldi { .. }))
        | Instruction::Arithmetic(Arithmetic::Sum(Sum::Subi { .. } | Sum::Sbci { .. }))
        | Instruction::Arithmetic(Arithmetic::Compare(Compare::Cpi { .. })) => plain(opcode & 0xf0f0),
        Instruction::Flow(Flow::Branch(Branch::Brbs { to, .. } | Branch::Brbc { to, .. })) => {
            (Form { opcode: opcode & 0xfc07, target: number(to) }, Kind::Branch)
        }
        Instruction::Flow(Flow::Jump(Jump::Rjmp { to })) => {
            (Form { opcode: RJMP, target: number(to) }, Kind::Other)
        }
        Instruction::Flow(Flow::Jump(Jump::Jmp { .. })) => plain(RJMP),
        Instruction::Flow(Flow::Jump(Jump::Ijmp)) => indirect,
        Instruction::Flow(Flow::Special(special)) => match special {
            Special::Rcall { .. } | Special::Call { .. } => plain(RCALL),
            Special::Ret | Special::Reti | Special::Icall => indirect,
            Special::Other if matches!(opcode, EIJMP | EICALL) => indirect,
            Special::Sbrs { .. }
            | Special::Sbrc { .. }
            | Special::Cpse { .. }
            | Special::Sbis { .. }
            | Special::Sbic { .. } => (Form { opcode, target: None }, Kind::Skip),
            _ => plain(opcode),
        },
        _ => plain(opcode),
    }
}
