//! The AVR's instructions, decoded (AVR Instruction Set Manual), for code that executes or inspects a
//! program.
//!
//! Opcodes that the manual reserves, and those of AVRs younger than the classic ones, decode as
//! [`Instruction::Invalid`].

mod decode;

pub use decode::{decode, has_two_words};

/// The pointer registers, by the number of their lower register.
pub const X: u8 = 26;
pub const Y: u8 = 28;
pub const Z: u8 = 30;

/// One instruction, in four bytes, since the programs of many MCUs are read in turns.
///
/// Registers are numbered 0 to 31, a pair by its lower one. Places in the data space, I/O registers too, have
/// their data address. A `mask` has one bit set. Similar instructions are side by side, and frequent ones
/// first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[rustfmt::skip] // one line each
pub enum Instruction {
    Movw { to: u8, from: u8 },
    Ldi { to: u8, value: u8 },
    Mov { to: u8, from: u8 },
    // Ldd uses a pointer and a displacement, LdStep a pointer that steps; so do Std and StStep.
    Ldd { to: u8, pointer: u8, displacement: u8 },
    Lds { to: u8, address: u16 },
    LdStep { to: u8, pointer: u8, step: Step },
    Std { from: u8, pointer: u8, displacement: u8 },
    Sts { from: u8, address: u16 },
    StStep { from: u8, pointer: u8, step: Step },
    Push { from: u8 },
    Pop { to: u8 },
    Cpi { one: u8, value: u8 },
    Cp { one: u8, other: u8 },
    Cpc { one: u8, other: u8 },
    // Brbs branches by `by` words from the next instruction if a flag is set, Brbc if it is clear.
    Brbs { mask: u8, by: i8 },
    Brbc { mask: u8, by: i8 },
    Subi { to: u8, value: u8 },
    Sbci { to: u8, value: u8 },
    Adiw { to: u8, value: u8 },
    Sbiw { to: u8, value: u8 },
    Add { to: u8, from: u8 },
    Adc { to: u8, from: u8 },
    Sub { to: u8, from: u8 },
    Sbc { to: u8, from: u8 },
    And { to: u8, from: u8 },
    Or { to: u8, from: u8 },
    Eor { to: u8, from: u8 },
    Andi { to: u8, value: u8 },
    Ori { to: u8, value: u8 },
    Com { to: u8 },
    Neg { to: u8 },
    Inc { to: u8 },
    Dec { to: u8 },
    Swap { to: u8 },
    Asr { to: u8 },
    Lsr { to: u8 },
    Ror { to: u8 },
    Mul { one: u8, other: u8 },
    Muls { one: u8, other: u8 },
    Mulsu { one: u8, other: u8 },
    Bst { from: u8, mask: u8 },
    Bld { to: u8, mask: u8 },
    // A flag other than I.
    Bset { mask: u8 },
    Bclr { mask: u8 },
    Rjmp { to: Word },
    Jmp { to: Word },
    Ijmp,
    Rcall { to: Word },
    Call { to: Word },
    Icall,
    Ret,
    Reti,
    // `skip` is the number of words of the instruction that may be skipped.
    Sbrs { from: u8, mask: u8, skip: u8 },
    Sbrc { from: u8, mask: u8, skip: u8 },
    Cpse { one: u8, other: u8, skip: u8 },
    Sbis { address: u8, mask: u8, skip: u8 },
    Sbic { address: u8, mask: u8, skip: u8 },
    In { to: u8, address: u8 },
    Out { from: u8, address: u8 },
    Cbi { address: u8, mask: u8 },
    Sbi { address: u8, mask: u8 },
    Sei,
    Cli,
    Lpm { to: u8 },
    LpmIncrement { to: u8 },
    Nop,
    Elpm { to: u8 },
    ElpmIncrement { to: u8 },
    /// FMUL, FMULS, FMULSU.
    FractionalProduct,
    Eijmp,
    Eicall,
    Sleep,
    Wdr,
    Break,
    Spm,
    /// An opcode without an instruction.
    Invalid,
}

const _: () = assert!(size_of::<Instruction>() == 4);

/// The direction in which a pointer steps: on after the access, or back before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    On,
    Back,
}

impl Instruction {
    /// The number of the variant, from 0 in their order, whatever its operands.
    pub const fn number(self) -> u8 {
        // SAFETY: an enumeration with `repr(u8)` begins with the number of its variant.
        unsafe { *std::ptr::from_ref(&self).cast() }
    }

    /// The target of a branch, jump or call at word `at`, if the instruction names its target.
    pub fn target(self, at: u32) -> Option<Word> {
        match self {
            Self::Brbs { by, .. } | Self::Brbc { by, .. } => Some(branch(at, by)),
            Self::Rjmp { to } | Self::Jmp { to } | Self::Rcall { to } | Self::Call { to } => Some(to),
            _ => None,
        }
    }
}

/// The target of a branch at word `at` by `by` words.
pub fn branch(at: u32, by: i8) -> Word {
    from_next(at, by.into())
}

/// The word that lies `words` behind the instruction that follows word `at`.
fn from_next(at: u32, words: i32) -> Word {
    Word::of((at + 1).wrapping_add_signed(words))
}

/// The number of a word in flash: 22 bits, all of which a jump names. It takes three bytes, since
/// instructions are read often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word([u8; 3]);

impl Word {
    /// A number beyond 24 bits wraps around.
    fn of(number: u32) -> Self {
        let [low, middle, high, _] = number.to_le_bytes();
        Self([low, middle, high])
    }
}

impl From<Word> for u32 {
    fn from(Word([low, middle, high]): Word) -> Self {
        Self::from_le_bytes([low, middle, high, 0])
    }
}
