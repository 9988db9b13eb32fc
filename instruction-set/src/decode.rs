//! Decodes words of flash into instructions.

use crate::Instruction::{self, *};
use crate::{Step, Word, X, Y, Z, from_next};

/// The instruction at word `at` of a program. `second` is the next word: the instruction's own second word,
/// or the first of the next instruction.
pub fn decode(at: u32, opcode: u16, second: u16) -> Instruction {
    let d = (opcode >> 4 & 0x1f) as u8;
    let r = (opcode >> 5 & 0x10 | opcode & 0xf) as u8;
    let high = 16 + (d & 0xf);
    let value = (opcode >> 4 & 0xf0 | opcode & 0xf) as u8;
    let mask = 1 << (opcode & 7);
    let skip = if has_two_words(second) { 2 } else { 1 };
    let io = 0x20 + (opcode >> 5 & 0x30 | opcode & 0xf) as u8;
    let bit_io = 0x20 + (opcode >> 3 & 0x1f) as u8;
    let near = from_next(at, i32::from((opcode << 4) as i16 >> 4));
    let by = ((opcode << 6) as i16 >> 9) as i8;
    let far = Word::of(u32::from(opcode >> 3 & 0x3e | opcode & 1) << 16 | u32::from(second));
    let displacement = (opcode >> 8 & 0x20 | opcode >> 7 & 0x18 | opcode & 7) as u8;
    let pointer = if opcode & 8 != 0 { Y } else { Z };
    let pair = 24 + (opcode >> 3 & 6) as u8;
    let word_value = (opcode >> 2 & 0x30 | opcode & 0xf) as u8;
    match opcode {
        0x0000 => Nop,
        0x0100..=0x01ff => Movw { to: d << 1 & 0x1e, from: r << 1 & 0x1e },
        0x0200..=0x02ff => Muls { one: high, other: 16 + (r & 0xf) },
        0x0300..=0x03ff if opcode & 0x88 == 0 => Mulsu { one: 16 + (d & 7), other: 16 + (r & 7) },
        0x0300..=0x03ff => FractionalProduct,
        0x0400..=0x07ff => Cpc { one: d, other: r },
        0x0800..=0x0bff => Sbc { to: d, from: r },
        0x0c00..=0x0fff => Add { to: d, from: r },
        0x1000..=0x13ff => Cpse { one: d, other: r, skip },
        0x1400..=0x17ff => Cp { one: d, other: r },
        0x1800..=0x1bff => Sub { to: d, from: r },
        0x1c00..=0x1fff => Adc { to: d, from: r },
        0x2000..=0x23ff => And { to: d, from: r },
        0x2400..=0x27ff => Eor { to: d, from: r },
        0x2800..=0x2bff => Or { to: d, from: r },
        0x2c00..=0x2fff => Mov { to: d, from: r },
        0x3000..=0x3fff => Cpi { one: high, value },
        0x4000..=0x4fff => Sbci { to: high, value },
        0x5000..=0x5fff => Subi { to: high, value },
        0x6000..=0x6fff => Ori { to: high, value },
        0x7000..=0x7fff => Andi { to: high, value },
        0x8000..=0x8fff | 0xa000..=0xafff if opcode & 0x0200 == 0 => Ldd { to: d, pointer, displacement },
        0x8000..=0x8fff | 0xa000..=0xafff => Std { from: d, pointer, displacement },
        0x9000..=0x91ff => match opcode & 0xf {
            0x0 => Lds { to: d, address: second },
            0x1 => LdStep { to: d, pointer: Z, step: Step::On },
            0x2 => LdStep { to: d, pointer: Z, step: Step::Back },
            0x4 => Lpm { to: d },
            0x5 => LpmIncrement { to: d },
            0x6 => Elpm { to: d },
            0x7 => ElpmIncrement { to: d },
            0x9 => LdStep { to: d, pointer: Y, step: Step::On },
            0xa => LdStep { to: d, pointer: Y, step: Step::Back },
            0xc => Ldd { to: d, pointer: X, displacement: 0 },
            0xd => LdStep { to: d, pointer: X, step: Step::On },
            0xe => LdStep { to: d, pointer: X, step: Step::Back },
            0xf => Pop { to: d },
            _ => Invalid,
        },
        0x9200..=0x93ff => match opcode & 0xf {
            0x0 => Sts { from: d, address: second },
            0x1 => StStep { from: d, pointer: Z, step: Step::On },
            0x2 => StStep { from: d, pointer: Z, step: Step::Back },
            0x9 => StStep { from: d, pointer: Y, step: Step::On },
            0xa => StStep { from: d, pointer: Y, step: Step::Back },
            0xc => Std { from: d, pointer: X, displacement: 0 },
            0xd => StStep { from: d, pointer: X, step: Step::On },
            0xe => StStep { from: d, pointer: X, step: Step::Back },
            0xf => Push { from: d },
            _ => Invalid,
        },
        0x9409 => Ijmp,
        0x9478 => Sei,
        0x94f8 => Cli,
        0x9508 => Ret,
        0x9509 => Icall,
        0x9518 => Reti,
        0x9419 => Eijmp,
        0x9519 => Eicall,
        0x9588 => Sleep,
        0x9598 => Break,
        0x95a8 => Wdr,
        0x95c8 => Lpm { to: 0 },
        0x95d8 => Elpm { to: 0 },
        0x95e8 => Spm,
        0x9400..=0x95ff => match opcode & 0xf {
            0x0 => Com { to: d },
            0x1 => Neg { to: d },
            0x2 => Swap { to: d },
            0x3 => Inc { to: d },
            0x5 => Asr { to: d },
            0x6 => Lsr { to: d },
            0x7 => Ror { to: d },
            0x8 if d < 8 => Bset { mask: 1 << d },
            0x8 if d < 16 => Bclr { mask: 1 << (d - 8) },
            0xa => Dec { to: d },
            0xc | 0xd => Jmp { to: far },
            0xe | 0xf => Call { to: far },
            _ => Invalid,
        },
        0x9600..=0x96ff => Adiw { to: pair, value: word_value },
        0x9700..=0x97ff => Sbiw { to: pair, value: word_value },
        0x9800..=0x98ff => Cbi { address: bit_io, mask },
        0x9900..=0x99ff => Sbic { address: bit_io, mask, skip },
        0x9a00..=0x9aff => Sbi { address: bit_io, mask },
        0x9b00..=0x9bff => Sbis { address: bit_io, mask, skip },
        0x9c00..=0x9fff => Mul { one: d, other: r },
        0xb000..=0xb7ff => In { to: d, address: io },
        0xb800..=0xbfff => Out { from: d, address: io },
        0xc000..=0xcfff => Rjmp { to: near },
        0xd000..=0xdfff => Rcall { to: near },
        0xe000..=0xefff => Ldi { to: high, value },
        0xf000..=0xf3ff => Brbs { mask, by },
        0xf400..=0xf7ff => Brbc { mask, by },
        0xf800..=0xffff if opcode & 8 != 0 => Invalid,
        0xf800..=0xf9ff => Bld { to: d, mask },
        0xfa00..=0xfbff => Bst { from: d, mask },
        0xfc00..=0xfdff => Sbrc { from: d, mask, skip },
        0xfe00..=0xffff => Sbrs { from: d, mask, skip },
        _ => Invalid,
    }
}

/// Whether an instruction has two words: LDS, STS, JMP and CALL do.
pub fn has_two_words(opcode: u16) -> bool {
    opcode & 0xfc0f == 0x9000 || opcode & 0xfe0c == 0x940c
}
