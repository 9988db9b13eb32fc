//! Instructions, decoded (instruction set manual).

/// The opcode of SPM.
const STORE_PROGRAM_MEMORY: u16 = 0x95e8;

/// The pointer registers, by the lower of their two registers.
pub const X: u8 = 26;
pub const Y: u8 = 28;
pub const Z: u8 = 30;

/// One instruction, in groups of at most three where it is frequent: then the host finds its way to it
/// through a few decisions, which it predicts better than the target of one jump to all instructions.
///
/// Registers are numbered 0 to 31, a pair by its lower one; places in the data space have their data address,
/// places in flash their word.
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
    Brbs { mask: u8, to: u16 },
    Brbc { mask: u8, to: u16 },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Jump {
    Rjmp { to: u16 },
    Jmp { to: u16 },
    Ijmp,
}

/// All others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Special {
    Rcall {
        to: u16,
    },
    Call {
        to: u16,
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
    /// Any other, or none at all.
    Other,
}

impl Instruction {
    /// Left to simavr.
    pub const OTHER: Self = Self::Flow(Flow::Special(Special::Other));
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

/// Decodes what is in flash, word by word: any of them may be jumped to. Nothing of a program that may write
/// its own flash.
pub fn decode(flash: &[u8]) -> Vec<Instruction> {
    let words: Vec<u16> = flash.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect();
    if words.contains(&STORE_PROGRAM_MEMORY) {
        return Vec::new();
    }
    let followers = words.iter().skip(1).copied().chain([u16::MAX]);
    let instructions = words.iter().zip(followers).enumerate();
    instructions.map(|(at, (&opcode, second))| instruction(at, opcode, second, words.len())).collect()
}

/// The instruction at word `at` of a program of so many `words`. `second` is the next word: its own, or the
/// next instruction's first.
pub(crate) fn instruction(at: usize, opcode: u16, second: u16, words: usize) -> Instruction {
    let d = (opcode >> 4 & 0x1f) as u8;
    let r = (opcode >> 5 & 0x10 | opcode & 0xf) as u8;
    let high = 16 + (d & 0xf);
    let value = (opcode >> 4 & 0xf0 | opcode & 0xf) as u8;
    let mask = 1 << (opcode & 7);
    let skip = if has_two_words(second) { 2 } else { 1 };
    let io = 0x20 + (opcode >> 5 & 0x30 | opcode & 0xf) as u8;
    let bit_io = 0x20 + (opcode >> 3 & 0x1f) as u8;
    // Counted from the next word.
    let relative = |words: i32| (at as u32 + 1).wrapping_add_signed(words);
    let near = relative(i32::from((opcode << 4) as i16 >> 4));
    let branch = relative(i32::from((opcode << 6) as i16 >> 9));
    let far = u32::from(opcode >> 3 & 0x3e | opcode & 1) << 16 | u32::from(second);
    // What leads out of the program, as round the end of the flash, is left to simavr.
    let target = |to: u32| u16::try_from(to).ok().filter(|&to| usize::from(to) < words);
    let displacement = (opcode >> 8 & 0x20 | opcode >> 7 & 0x18 | opcode & 7) as u8;
    let pointer = if opcode & 8 != 0 { Y } else { Z };
    let pair = 24 + (opcode >> 3 & 6) as u8;
    let word_value = (opcode >> 2 & 0x30 | opcode & 0xf) as u8;
    match opcode {
        0x0000 => Special::Nop.into(),
        0x0100..=0x01ff => Move::Movw { to: d << 1 & 0x1e, from: r << 1 & 0x1e }.into(),
        0x0200..=0x02ff => Bits::Muls { one: high, other: 16 + (r & 0xf) }.into(),
        0x0300..=0x03ff if opcode & 0x88 == 0 => {
            Bits::Mulsu { one: 16 + (d & 7), other: 16 + (r & 7) }.into()
        }
        0x0400..=0x07ff => Compare::Cpc { one: d, other: r }.into(),
        0x0800..=0x0bff => Sum::Sbc { to: d, from: r }.into(),
        0x0c00..=0x0fff => Sum::Add { to: d, from: r }.into(),
        0x1000..=0x13ff => Special::Cpse { one: d, other: r, skip }.into(),
        0x1400..=0x17ff => Compare::Cp { one: d, other: r }.into(),
        0x1800..=0x1bff => Sum::Sub { to: d, from: r }.into(),
        0x1c00..=0x1fff => Sum::Adc { to: d, from: r }.into(),
        0x2000..=0x23ff => Bits::And { to: d, from: r }.into(),
        0x2400..=0x27ff => Bits::Eor { to: d, from: r }.into(),
        0x2800..=0x2bff => Bits::Or { to: d, from: r }.into(),
        0x2c00..=0x2fff => Move::Mov { to: d, from: r }.into(),
        0x3000..=0x3fff => Compare::Cpi { one: high, value }.into(),
        0x4000..=0x4fff => Sum::Sbci { to: high, value }.into(),
        0x5000..=0x5fff => Sum::Subi { to: high, value }.into(),
        0x6000..=0x6fff => Bits::Ori { to: high, value }.into(),
        0x7000..=0x7fff => Bits::Andi { to: high, value }.into(),
        0x8000..=0x8fff | 0xa000..=0xafff if opcode & 0x0200 == 0 => {
            Load::Ldd { to: d, pointer, displacement }.into()
        }
        0x8000..=0x8fff | 0xa000..=0xafff => Store::Std { from: d, pointer, displacement }.into(),
        0x9000..=0x91ff => match opcode & 0xf {
            0x0 => Load::Lds { to: d, address: second }.into(),
            0x1 => Load::LdStep { to: d, pointer: Z, step: Step::On }.into(),
            0x2 => Load::LdStep { to: d, pointer: Z, step: Step::Back }.into(),
            0x4 => Special::Lpm { to: d }.into(),
            0x5 => Special::LpmIncrement { to: d }.into(),
            0x9 => Load::LdStep { to: d, pointer: Y, step: Step::On }.into(),
            0xa => Load::LdStep { to: d, pointer: Y, step: Step::Back }.into(),
            0xc => Load::Ldd { to: d, pointer: X, displacement: 0 }.into(),
            0xd => Load::LdStep { to: d, pointer: X, step: Step::On }.into(),
            0xe => Load::LdStep { to: d, pointer: X, step: Step::Back }.into(),
            0xf => Stack::Pop { to: d }.into(),
            _ => Instruction::OTHER,
        },
        0x9200..=0x93ff => match opcode & 0xf {
            0x0 => Store::Sts { from: d, address: second }.into(),
            0x1 => Store::StStep { from: d, pointer: Z, step: Step::On }.into(),
            0x2 => Store::StStep { from: d, pointer: Z, step: Step::Back }.into(),
            0x9 => Store::StStep { from: d, pointer: Y, step: Step::On }.into(),
            0xa => Store::StStep { from: d, pointer: Y, step: Step::Back }.into(),
            0xc => Store::Std { from: d, pointer: X, displacement: 0 }.into(),
            0xd => Store::StStep { from: d, pointer: X, step: Step::On }.into(),
            0xe => Store::StStep { from: d, pointer: X, step: Step::Back }.into(),
            0xf => Stack::Push { from: d }.into(),
            _ => Instruction::OTHER,
        },
        0x9409 => Jump::Ijmp.into(),
        0x9478 => Special::Sei.into(),
        0x94f8 => Special::Cli.into(),
        0x9508 => Special::Ret.into(),
        0x9509 => Special::Icall.into(),
        0x9518 => Special::Reti.into(),
        0x95c8 => Special::Lpm { to: 0 }.into(),
        0x9400..=0x95ff => match opcode & 0xf {
            0x0 => Bits::Com { to: d }.into(),
            0x1 => Bits::Neg { to: d }.into(),
            0x2 => Bits::Swap { to: d }.into(),
            0x3 => Bits::Inc { to: d }.into(),
            0x5 => Bits::Asr { to: d }.into(),
            0x6 => Bits::Lsr { to: d }.into(),
            0x7 => Bits::Ror { to: d }.into(),
            0x8 if d < 8 => Bits::Bset { mask: 1 << d }.into(),
            0x8 if d < 16 => Bits::Bclr { mask: 1 << (d - 8) }.into(),
            0xa => Bits::Dec { to: d }.into(),
            0xc | 0xd => target(far).map_or(Instruction::OTHER, |to| Jump::Jmp { to }.into()),
            0xe | 0xf => target(far).map_or(Instruction::OTHER, |to| Special::Call { to }.into()),
            _ => Instruction::OTHER,
        },
        0x9600..=0x96ff => Sum::Adiw { to: pair, value: word_value }.into(),
        0x9700..=0x97ff => Sum::Sbiw { to: pair, value: word_value }.into(),
        0x9800..=0x98ff => Special::Cbi { address: bit_io, mask }.into(),
        0x9900..=0x99ff => Special::Sbic { address: bit_io, mask, skip }.into(),
        0x9a00..=0x9aff => Special::Sbi { address: bit_io, mask }.into(),
        0x9b00..=0x9bff => Special::Sbis { address: bit_io, mask, skip }.into(),
        0x9c00..=0x9fff => Bits::Mul { one: d, other: r }.into(),
        0xb000..=0xb7ff => Special::In { to: d, address: io }.into(),
        0xb800..=0xbfff => Special::Out { from: d, address: io }.into(),
        0xc000..=0xcfff => target(near).map_or(Instruction::OTHER, |to| Jump::Rjmp { to }.into()),
        0xd000..=0xdfff => target(near).map_or(Instruction::OTHER, |to| Special::Rcall { to }.into()),
        0xe000..=0xefff => Move::Ldi { to: high, value }.into(),
        0xf000..=0xf3ff => target(branch).map_or(Instruction::OTHER, |to| Branch::Brbs { mask, to }.into()),
        0xf400..=0xf7ff => target(branch).map_or(Instruction::OTHER, |to| Branch::Brbc { mask, to }.into()),
        0xf800..=0xf9ff => Bits::Bld { to: d, mask }.into(),
        0xfa00..=0xfbff => Bits::Bst { from: d, mask }.into(),
        0xfc00..=0xfdff => Special::Sbrc { from: d, mask, skip }.into(),
        0xfe00..=0xffff => Special::Sbrs { from: d, mask, skip }.into(),
        _ => Instruction::OTHER,
    }
}

/// LDS, STS, JMP and CALL.
pub(crate) fn has_two_words(opcode: u16) -> bool {
    opcode & 0xfc0f == 0x9000 || opcode & 0xfe0c == 0x940c
}
