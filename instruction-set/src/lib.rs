//! The AVR's instructions, decoded (AVR Instruction Set Manual): for all that executes a program or looks into one.
//!
//! Opcodes that the manual reserves, and those of AVRs younger than the classic ones, are no instructions here.

mod decode;

pub use decode::{decode, has_two_words};

/// The pointer registers, by the lower of their two registers.
pub const X: u8 = 26;
pub const Y: u8 = 28;
pub const Z: u8 = 30;

/// One instruction, in groups of at most three where it is frequent: then the host finds its way to it
/// through a few decisions, which it predicts better than the target of one jump to all instructions.
///
/// Registers are numbered 0 to 31, a pair by its lower one; places in the data space have their data address,
/// I/O registers too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Instruction {
    Transfer(Transfer),
    Arithmetic(Arithmetic),
    Flow(Flow),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Transfer {
    Move(Move),
    Memory(Memory),
    Stack(Stack),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Move {
    Movw { to: u8, from: u8 },
    Ldi { to: u8, value: u8 },
    Mov { to: u8, from: u8 },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Memory {
    Load(Load),
    Store(Store),
}

/// Ldd goes by a pointer and a displacement, LdStep by a pointer that steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    Ldd { to: u8, pointer: u8, displacement: u8 },
    Lds { to: u8, address: u16 },
    LdStep { to: u8, pointer: u8, step: Step },
}

/// Likewise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Store {
    Std { from: u8, pointer: u8, displacement: u8 },
    Sts { from: u8, address: u16 },
    StStep { from: u8, pointer: u8, step: Step },
}

/// Which way a pointer steps: on after the access, or back before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    On,
    Back,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stack {
    Push { from: u8 },
    Pop { to: u8 },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Arithmetic {
    Compare(Compare),
    Sum(Sum),
    Bits(Bits),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compare {
    Cpi { one: u8, value: u8 },
    Cp { one: u8, other: u8 },
    Cpc { one: u8, other: u8 },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sum {
    Subi { to: u8, value: u8 },
    Sbci { to: u8, value: u8 },
    Adiw { to: u8, value: u8 },
    Sbiw { to: u8, value: u8 },
    Add { to: u8, from: u8 },
    Adc { to: u8, from: u8 },
    Sub { to: u8, from: u8 },
    Sbc { to: u8, from: u8 },
}

/// Logic, shifts, and what is left of the arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bits {
    And {
        to: u8,
        from: u8,
    },
    Or {
        to: u8,
        from: u8,
    },
    Eor {
        to: u8,
        from: u8,
    },
    Andi {
        to: u8,
        value: u8,
    },
    Ori {
        to: u8,
        value: u8,
    },
    Com {
        to: u8,
    },
    Neg {
        to: u8,
    },
    Inc {
        to: u8,
    },
    Dec {
        to: u8,
    },
    Swap {
        to: u8,
    },
    Asr {
        to: u8,
    },
    Lsr {
        to: u8,
    },
    Ror {
        to: u8,
    },
    Mul {
        one: u8,
        other: u8,
    },
    Muls {
        one: u8,
        other: u8,
    },
    Mulsu {
        one: u8,
        other: u8,
    },
    Bst {
        from: u8,
        mask: u8,
    },
    Bld {
        to: u8,
        mask: u8,
    },
    /// A flag other than I.
    Bset {
        mask: u8,
    },
    Bclr {
        mask: u8,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Flow {
    Branch(Branch),
    Jump(Jump),
    Special(Special),
}

/// Brbs branches if a flag is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    Brbs { mask: u8, to: Word },
    Brbc { mask: u8, to: Word },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Jump {
    Rjmp { to: Word },
    Jmp { to: Word },
    Ijmp,
}

/// All others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Special {
    Rcall {
        to: Word,
    },
    Call {
        to: Word,
    },
    Icall,
    Ret,
    Reti,
    /// `skip` is the words of the instruction that may be skipped.
    Sbrs {
        from: u8,
        mask: u8,
        skip: u8,
    },
    Sbrc {
        from: u8,
        mask: u8,
        skip: u8,
    },
    Cpse {
        one: u8,
        other: u8,
        skip: u8,
    },
    Sbis {
        address: u8,
        mask: u8,
        skip: u8,
    },
    Sbic {
        address: u8,
        mask: u8,
        skip: u8,
    },
    In {
        to: u8,
        address: u8,
    },
    Out {
        from: u8,
        address: u8,
    },
    Cbi {
        address: u8,
        mask: u8,
    },
    Sbi {
        address: u8,
        mask: u8,
    },
    Sei,
    Cli,
    Lpm {
        to: u8,
    },
    LpmIncrement {
        to: u8,
    },
    Nop,
    Rare(Rare),
}

/// What programs do now and then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rare {
    Elpm {
        to: u8,
    },
    ElpmIncrement {
        to: u8,
    },
    /// FMUL, FMULS, FMULSU.
    FractionalProduct,
    Eijmp,
    Eicall,
    Sleep,
    Wdr,
    Break,
    Spm,
    /// No instruction.
    None,
}

impl Instruction {
    pub const NONE: Self = Self::Flow(Flow::Special(Special::Rare(Rare::None)));

    /// Where a branch, a jump or a call leads whose target the instruction names.
    pub fn target(self) -> Option<Word> {
        let Self::Flow(flow) = self else { return None };
        match flow {
            Flow::Branch(Branch::Brbs { to, .. } | Branch::Brbc { to, .. })
            | Flow::Jump(Jump::Rjmp { to } | Jump::Jmp { to })
            | Flow::Special(Special::Rcall { to } | Special::Call { to }) => Some(to),
            Flow::Jump(Jump::Ijmp) | Flow::Special(_) => None,
        }
    }
}

/// The number of a word in flash: 22 bits, of which a jump names all. Three bytes, for instructions are read often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word([u8; 3]);

impl Word {
    /// What leads out of 24 bits comes in again at their other end.
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

/// Each group is an instruction.
macro_rules! groups {
    ($($class:ident: $($group:ident)*;)*) => {$($(
        impl From<$group> for Instruction {
            fn from(instruction: $group) -> Self {
                Self::$class($class::$group(instruction))
            }
        }
    )*)*};
}

groups! {
    Transfer: Move Memory Stack;
    Arithmetic: Compare Sum Bits;
    Flow: Branch Jump Special;
}

impl From<Rare> for Instruction {
    fn from(instruction: Rare) -> Self {
        Special::Rare(instruction).into()
    }
}

impl From<Load> for Instruction {
    fn from(instruction: Load) -> Self {
        Memory::Load(instruction).into()
    }
}

impl From<Store> for Instruction {
    fn from(instruction: Store) -> Self {
        Memory::Store(instruction).into()
    }
}
