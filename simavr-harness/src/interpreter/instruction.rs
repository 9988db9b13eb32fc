//! Instructions, decoded (instruction set manual).

/// The opcode of SPM.
const STORE_PROGRAM_MEMORY: u16 = 0x95e8;

/// The pointer registers, by the lower of their two registers.
pub const X: u8 = 26;
pub const Y: u8 = 28;
pub const Z: u8 = 30;

/// One instruction. Registers are numbered 0 to 31, a pair by its lower one; places in the data space have their data
/// address, places in flash their word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction {
    Nop,
    Mov {
        to: u8,
        from: u8,
    },
    Movw {
        to: u8,
        from: u8,
    },
    Ldi {
        to: u8,
        value: u8,
    },
    Add {
        to: u8,
        from: u8,
    },
    Adc {
        to: u8,
        from: u8,
    },
    Sub {
        to: u8,
        from: u8,
    },
    Sbc {
        to: u8,
        from: u8,
    },
    Subi {
        to: u8,
        value: u8,
    },
    Sbci {
        to: u8,
        value: u8,
    },
    Cp {
        one: u8,
        other: u8,
    },
    Cpc {
        one: u8,
        other: u8,
    },
    Cpi {
        one: u8,
        value: u8,
    },
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
    Adiw {
        to: u8,
        value: u8,
    },
    Sbiw {
        to: u8,
        value: u8,
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
    Sei,
    Cli,
    /// By a pointer and a displacement.
    Ldd {
        to: u8,
        pointer: u8,
        displacement: u8,
    },
    Std {
        from: u8,
        pointer: u8,
        displacement: u8,
    },
    LdIncrement {
        to: u8,
        pointer: u8,
    },
    StIncrement {
        from: u8,
        pointer: u8,
    },
    LdDecrement {
        to: u8,
        pointer: u8,
    },
    StDecrement {
        from: u8,
        pointer: u8,
    },
    Lds {
        to: u8,
        address: u16,
    },
    Sts {
        from: u8,
        address: u16,
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
    Push {
        from: u8,
    },
    Pop {
        to: u8,
    },
    Lpm {
        to: u8,
    },
    LpmIncrement {
        to: u8,
    },
    Rjmp {
        to: u32,
    },
    Jmp {
        to: u32,
    },
    Ijmp,
    Rcall {
        to: u32,
    },
    Call {
        to: u32,
    },
    Icall,
    Ret,
    Reti,
    /// Branches if a flag is set.
    Brbs {
        mask: u8,
        to: u32,
    },
    Brbc {
        mask: u8,
        to: u32,
    },
    /// `skip` is the words of the instruction that may be skipped.
    Cpse {
        one: u8,
        other: u8,
        skip: u8,
    },
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
    /// Any other, or none at all.
    Other,
}

/// Decodes what is in flash, word by word: any of them may be jumped to. Nothing of a program that may write its own
/// flash.
pub fn decode(flash: &[u8]) -> Vec<Instruction> {
    let words: Vec<u16> = flash.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect();
    if words.contains(&STORE_PROGRAM_MEMORY) {
        return Vec::new();
    }
    let followers = words.iter().skip(1).copied().chain([u16::MAX]);
    let instructions = words.iter().zip(followers).enumerate();
    let decoded = instructions.map(|(at, (&opcode, second))| instruction(at, opcode, second));
    decoded
        .map(
            |instruction| if goes_round(instruction, words.len()) { Instruction::Other } else { instruction },
        )
        .collect()
}

/// The instruction at word `at`, of which `second` is the second word if it has one, and else the next instruction's first.
fn instruction(at: usize, opcode: u16, second: u16) -> Instruction {
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
    let displacement = (opcode >> 8 & 0x20 | opcode >> 7 & 0x18 | opcode & 7) as u8;
    let pointer = if opcode & 8 != 0 { Y } else { Z };
    let pair = 24 + (opcode >> 3 & 6) as u8;
    let word_value = (opcode >> 2 & 0x30 | opcode & 0xf) as u8;
    match opcode {
        0x0000 => Instruction::Nop,
        0x0100..=0x01ff => Instruction::Movw { to: d << 1 & 0x1e, from: r << 1 & 0x1e },
        0x0200..=0x02ff => Instruction::Muls { one: high, other: 16 + (r & 0xf) },
        0x0300..=0x03ff if opcode & 0x88 == 0 => {
            Instruction::Mulsu { one: 16 + (d & 7), other: 16 + (r & 7) }
        }
        0x0400..=0x07ff => Instruction::Cpc { one: d, other: r },
        0x0800..=0x0bff => Instruction::Sbc { to: d, from: r },
        0x0c00..=0x0fff => Instruction::Add { to: d, from: r },
        0x1000..=0x13ff => Instruction::Cpse { one: d, other: r, skip },
        0x1400..=0x17ff => Instruction::Cp { one: d, other: r },
        0x1800..=0x1bff => Instruction::Sub { to: d, from: r },
        0x1c00..=0x1fff => Instruction::Adc { to: d, from: r },
        0x2000..=0x23ff => Instruction::And { to: d, from: r },
        0x2400..=0x27ff => Instruction::Eor { to: d, from: r },
        0x2800..=0x2bff => Instruction::Or { to: d, from: r },
        0x2c00..=0x2fff => Instruction::Mov { to: d, from: r },
        0x3000..=0x3fff => Instruction::Cpi { one: high, value },
        0x4000..=0x4fff => Instruction::Sbci { to: high, value },
        0x5000..=0x5fff => Instruction::Subi { to: high, value },
        0x6000..=0x6fff => Instruction::Ori { to: high, value },
        0x7000..=0x7fff => Instruction::Andi { to: high, value },
        0x8000..=0x8fff | 0xa000..=0xafff if opcode & 0x0200 == 0 => {
            Instruction::Ldd { to: d, pointer, displacement }
        }
        0x8000..=0x8fff | 0xa000..=0xafff => Instruction::Std { from: d, pointer, displacement },
        0x9000..=0x91ff => match opcode & 0xf {
            0x0 => Instruction::Lds { to: d, address: second },
            0x1 => Instruction::LdIncrement { to: d, pointer: Z },
            0x2 => Instruction::LdDecrement { to: d, pointer: Z },
            0x4 => Instruction::Lpm { to: d },
            0x5 => Instruction::LpmIncrement { to: d },
            0x9 => Instruction::LdIncrement { to: d, pointer: Y },
            0xa => Instruction::LdDecrement { to: d, pointer: Y },
            0xc => Instruction::Ldd { to: d, pointer: X, displacement: 0 },
            0xd => Instruction::LdIncrement { to: d, pointer: X },
            0xe => Instruction::LdDecrement { to: d, pointer: X },
            0xf => Instruction::Pop { to: d },
            _ => Instruction::Other,
        },
        0x9200..=0x93ff => match opcode & 0xf {
            0x0 => Instruction::Sts { from: d, address: second },
            0x1 => Instruction::StIncrement { from: d, pointer: Z },
            0x2 => Instruction::StDecrement { from: d, pointer: Z },
            0x9 => Instruction::StIncrement { from: d, pointer: Y },
            0xa => Instruction::StDecrement { from: d, pointer: Y },
            0xc => Instruction::Std { from: d, pointer: X, displacement: 0 },
            0xd => Instruction::StIncrement { from: d, pointer: X },
            0xe => Instruction::StDecrement { from: d, pointer: X },
            0xf => Instruction::Push { from: d },
            _ => Instruction::Other,
        },
        0x9409 => Instruction::Ijmp,
        0x9478 => Instruction::Sei,
        0x94f8 => Instruction::Cli,
        0x9508 => Instruction::Ret,
        0x9509 => Instruction::Icall,
        0x9518 => Instruction::Reti,
        0x95c8 => Instruction::Lpm { to: 0 },
        0x9400..=0x95ff => match opcode & 0xf {
            0x0 => Instruction::Com { to: d },
            0x1 => Instruction::Neg { to: d },
            0x2 => Instruction::Swap { to: d },
            0x3 => Instruction::Inc { to: d },
            0x5 => Instruction::Asr { to: d },
            0x6 => Instruction::Lsr { to: d },
            0x7 => Instruction::Ror { to: d },
            0x8 if d < 8 => Instruction::Bset { mask: 1 << d },
            0x8 if d < 16 => Instruction::Bclr { mask: 1 << (d - 8) },
            0xa => Instruction::Dec { to: d },
            0xc | 0xd => Instruction::Jmp { to: far },
            0xe | 0xf => Instruction::Call { to: far },
            _ => Instruction::Other,
        },
        0x9600..=0x96ff => Instruction::Adiw { to: pair, value: word_value },
        0x9700..=0x97ff => Instruction::Sbiw { to: pair, value: word_value },
        0x9800..=0x98ff => Instruction::Cbi { address: bit_io, mask },
        0x9900..=0x99ff => Instruction::Sbic { address: bit_io, mask, skip },
        0x9a00..=0x9aff => Instruction::Sbi { address: bit_io, mask },
        0x9b00..=0x9bff => Instruction::Sbis { address: bit_io, mask, skip },
        0x9c00..=0x9fff => Instruction::Mul { one: d, other: r },
        0xb000..=0xb7ff => Instruction::In { to: d, address: io },
        0xb800..=0xbfff => Instruction::Out { from: d, address: io },
        0xc000..=0xcfff => Instruction::Rjmp { to: near },
        0xd000..=0xdfff => Instruction::Rcall { to: near },
        0xe000..=0xefff => Instruction::Ldi { to: high, value },
        0xf000..=0xf3ff => Instruction::Brbs { mask, to: branch },
        0xf400..=0xf7ff => Instruction::Brbc { mask, to: branch },
        0xf800..=0xf9ff => Instruction::Bld { to: d, mask },
        0xfa00..=0xfbff => Instruction::Bst { from: d, mask },
        0xfc00..=0xfdff => Instruction::Sbrc { from: d, mask, skip },
        0xfe00..=0xffff => Instruction::Sbrs { from: d, mask, skip },
        _ => Instruction::Other,
    }
}

/// Whether a jump leads out of the program: round the end of the flash, whose size is not known here.
fn goes_round(instruction: Instruction, words: usize) -> bool {
    matches!(instruction, Instruction::Rjmp { to } | Instruction::Rcall { to } if to as usize >= words)
}

/// LDS, STS, JMP and CALL.
fn has_two_words(opcode: u16) -> bool {
    opcode & 0xfc0f == 0x9000 || opcode & 0xfe0c == 0x940c
}
