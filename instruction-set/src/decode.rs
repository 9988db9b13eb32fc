//! From words of flash to instructions.

use crate::{
    Bits, Branch, Compare, Instruction, Jump, Load, Move, Rare, Special, Stack, Step, Store, Sum, Word, X, Y,
    Z,
};

/// The instruction at word `at` of a program. `second` is the next word: its own, or the next instruction's
/// first.
pub fn decode(at: u32, opcode: u16, second: u16) -> Instruction {
    let d = (opcode >> 4 & 0x1f) as u8;
    let r = (opcode >> 5 & 0x10 | opcode & 0xf) as u8;
    let high = 16 + (d & 0xf);
    let value = (opcode >> 4 & 0xf0 | opcode & 0xf) as u8;
    let mask = 1 << (opcode & 7);
    let skip = if has_two_words(second) { 2 } else { 1 };
    let io = 0x20 + (opcode >> 5 & 0x30 | opcode & 0xf) as u8;
    let bit_io = 0x20 + (opcode >> 3 & 0x1f) as u8;
    // Counted from the next word.
    let relative = |words: i32| Word::of((at + 1).wrapping_add_signed(words));
    let near = relative(i32::from((opcode << 4) as i16 >> 4));
    let branch = relative(i32::from((opcode << 6) as i16 >> 9));
    let far = Word::of(u32::from(opcode >> 3 & 0x3e | opcode & 1) << 16 | u32::from(second));
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
        0x0300..=0x03ff => Rare::FractionalProduct.into(),
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
            0x6 => Rare::Elpm { to: d }.into(),
            0x7 => Rare::ElpmIncrement { to: d }.into(),
            0x9 => Load::LdStep { to: d, pointer: Y, step: Step::On }.into(),
            0xa => Load::LdStep { to: d, pointer: Y, step: Step::Back }.into(),
            0xc => Load::Ldd { to: d, pointer: X, displacement: 0 }.into(),
            0xd => Load::LdStep { to: d, pointer: X, step: Step::On }.into(),
            0xe => Load::LdStep { to: d, pointer: X, step: Step::Back }.into(),
            0xf => Stack::Pop { to: d }.into(),
            _ => Instruction::NONE,
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
            _ => Instruction::NONE,
        },
        0x9409 => Jump::Ijmp.into(),
        0x9478 => Special::Sei.into(),
        0x94f8 => Special::Cli.into(),
        0x9508 => Special::Ret.into(),
        0x9509 => Special::Icall.into(),
        0x9518 => Special::Reti.into(),
        0x9419 => Rare::Eijmp.into(),
        0x9519 => Rare::Eicall.into(),
        0x9588 => Rare::Sleep.into(),
        0x9598 => Rare::Break.into(),
        0x95a8 => Rare::Wdr.into(),
        0x95c8 => Special::Lpm { to: 0 }.into(),
        0x95d8 => Rare::Elpm { to: 0 }.into(),
        0x95e8 => Rare::Spm.into(),
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
            0xc | 0xd => Jump::Jmp { to: far }.into(),
            0xe | 0xf => Special::Call { to: far }.into(),
            _ => Instruction::NONE,
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
        0xc000..=0xcfff => Jump::Rjmp { to: near }.into(),
        0xd000..=0xdfff => Special::Rcall { to: near }.into(),
        0xe000..=0xefff => Move::Ldi { to: high, value }.into(),
        0xf000..=0xf3ff => Branch::Brbs { mask, to: branch }.into(),
        0xf400..=0xf7ff => Branch::Brbc { mask, to: branch }.into(),
        0xf800..=0xffff if opcode & 8 != 0 => Instruction::NONE,
        0xf800..=0xf9ff => Bits::Bld { to: d, mask }.into(),
        0xfa00..=0xfbff => Bits::Bst { from: d, mask }.into(),
        0xfc00..=0xfdff => Special::Sbrc { from: d, mask, skip }.into(),
        0xfe00..=0xffff => Special::Sbrs { from: d, mask, skip }.into(),
        _ => Instruction::NONE,
    }
}

/// Whether an instruction takes the next word, too: LDS, STS, JMP and CALL do.
pub fn has_two_words(opcode: u16) -> bool {
    opcode & 0xfc0f == 0x9000 || opcode & 0xfe0c == 0x940c
}
