use std::process::Command;

use instruction_set::X;

use super::*;

fn effect_of(words: &[u16]) -> Option<(Effect, u32)> {
    let flash: Vec<_> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    effect(&flash, 0)
}

#[test]
fn a_subtraction_from_a_pair_is_one() {
    assert_eq!(effect_of(&[0x56c2, 0x40d1]), Some((Effect::AddPair(28, -0x162), 4))); // subi r28, 0x62; sbci r29, 1
    assert_eq!(effect_of(&[0x5ece, 0x4fdf]), Some((Effect::AddPair(28, 0x12), 4))); // subi r28, 0xee; sbci r29, 0xff
    // subi r28, 0x9d; sbc r29, r1
    assert_eq!(effect_of(&[0x59cd, 0x09d1]), Some((Effect::AddPair(28, -0x9d), 4)));
    assert_eq!(effect_of(&[0x59cd, 0x09d0]), Some((Effect::Other(1 << 28), 2)), "r0 is not always 0");
    assert_eq!(effect_of(&[0x56c2, 0x40f1]), Some((Effect::Other(1 << 28), 2)), "r28, but r31");
    assert_eq!(effect_of(&[0x57d0, 0x40e1]), Some((Effect::Other(1 << 29), 2)), "not a pair");
}

#[test]
fn the_stack_pointer_in_the_data_space() {
    assert_eq!(effect_of(&[0x93c0, 0x005d]), Some((Effect::WriteStackPointer(Half::Low, 28), 4))); // sts 0x5d, r28
    assert_eq!(effect_of(&[0x93d0, 0x005e]), Some((Effect::WriteStackPointer(Half::High, 29), 4)));
    assert_eq!(effect_of(&[0x91c0, 0x005d]), Some((Effect::Other(1 << 28), 4))); // lds r28, 0x5d
}

#[test]
fn a_comparison_of_a_pair_is_one() {
    assert_eq!(effect_of(&[0x3dc1, 0x07d8]), Some((Effect::ComparePair(28, 0xd1, 24), 4))); // cpi r28, 0xd1; cpc r29, r24
    assert_eq!(effect_of(&[0x3dc1, 0x07e8]), Some((NOTHING, 2)), "r28, but r30");
    assert_eq!(effect_of(&[0x3dc1, 0x0bd8]), Some((NOTHING, 2)), "sbc");
}

#[test]
fn the_status_in_the_data_space() {
    assert_eq!(effect_of(&[0x9380, 0x005f]), Some((Effect::WriteStatus(24), 4))); // sts 0x5f, r24
    assert_eq!(effect_of(&[0x9180, 0x005f]), Some((Effect::ReadStatus(24), 4))); // lds r24, 0x5f
}

#[test]
fn half_an_instruction_is_none() {
    assert_eq!(effect_of(&[0x940e]), None);
    assert_eq!(effect_of(&[0xffff]), None, "flash that was not programmed");
}

/// Compares every word, followed by a zero word, with the output of avr-objdump.
#[test]
fn every_word_as_objdump_reads_it() {
    let flash: Vec<u8> = (0..=u16::MAX).flat_map(|word| [word.to_le_bytes(), [0; 2]]).flatten().collect();
    let path = std::env::temp_dir().join(format!("stack-bound-{}.bin", std::process::id()));
    std::fs::write(&path, &flash).expect("a temporary file can be written");
    let output = Command::new("avr-objdump")
        .args(["-D", "-z", "--no-show-raw-insn", "-b", "binary", "-m", "avr:51"])
        .arg(&path)
        .output()
        .expect("avr-objdump runs (Debian: binutils-avr; ./x test installs it)");
    std::fs::remove_file(&path).expect("the temporary file can be removed");
    let listing = String::from_utf8(output.stdout).expect("avr-objdump prints text");

    let mut words = 0;
    for line in listing.lines() {
        let Some((address, text)) = line.split_once(":\t") else { continue };
        let address = u32::from_str_radix(address.trim(), 16).expect("each line begins with its address");
        if address.is_multiple_of(4) {
            let decoded = effect(&flash, address).map(|(effect, _)| effect);
            assert_eq!(decoded, expected(text, address + 2), "{:04x}: {text}", address / 4);
            words += 1;
        }
    }
    assert_eq!(words, 0x10000);
}

/// The effect that a line of avr-objdump describes.
fn expected(text: &str, next: u32) -> Option<Effect> {
    let text = text.split(';').next().unwrap_or_default().trim();
    let (mnemonic, operands) = text.split_once('\t').unwrap_or((text, ""));
    let (to, from) = operands.split_once(", ").unwrap_or((operands, ""));
    let register = |operand: &str| operand.strip_prefix('r').and_then(|number| number.parse::<u8>().ok());
    let number = |operand: &str| {
        let digits = operand.strip_prefix("0x");
        digits.map_or(operand.parse(), |digits| u32::from_str_radix(digits, 16)).expect("a number")
    };
    let relative = || {
        let distance = to.strip_prefix('.').and_then(|distance| distance.parse().ok());
        next.wrapping_add_signed(distance.expect("a distance"))
    };
    let change = || Some(Effect::Other(1 << register(to)?));
    let pointer = |operand: &str| match operand {
        "X+" | "-X" => pair(X),
        "Y+" | "-Y" => pair(Y),
        "Z+" | "-Z" => pair(Z),
        _ => 0,
    };
    match mnemonic {
        "push" => register(to).map(Effect::Push),
        "pop" => register(to).map(Effect::Pop),
        "ldi" => Some(Effect::Load(register(to)?, number(from) as u8)),
        "ori" => Some(Effect::SetBits(register(to)?, number(from) as u8)),
        "andi" => Some(Effect::KeepBits(register(to)?, number(from) as u8)),
        "mov" => Some(Effect::Copy(register(to)?, register(from)?)),
        "movw" => Some(Effect::CopyPair(register(to)?, register(from)?)),
        "adiw" => Some(Effect::AddPair(register(to)?, number(from) as i16)),
        "sbiw" => Some(Effect::AddPair(register(to)?, -(number(from) as i16))),
        "in" if from == "0x3d" => Some(Effect::ReadStackPointer(Half::Low, register(to)?)),
        "in" if from == "0x3e" => Some(Effect::ReadStackPointer(Half::High, register(to)?)),
        "in" if from == "0x3f" => Some(Effect::ReadStatus(register(to)?)),
        "out" if to == "0x3f" => Some(Effect::WriteStatus(register(from)?)),
        "sei" => Some(Effect::EnableInterrupts),
        "cli" => Some(Effect::DisableInterrupts),
        "out" if to == "0x3d" => Some(Effect::WriteStackPointer(Half::Low, register(from)?)),
        "out" if to == "0x3e" => Some(Effect::WriteStackPointer(Half::High, register(from)?)),
        "jmp" => Some(Effect::Jump(number(to))),
        "call" => Some(Effect::Call(number(to))),
        "rjmp" => Some(Effect::Jump(relative())),
        "rcall" => Some(Effect::Call(relative())),
        "ijmp" | "eijmp" => Some(Effect::JumpIndirect),
        "icall" | "eicall" => Some(Effect::CallIndirect),
        "ret" | "reti" => Some(Effect::Return),
        "cpse" | "sbrc" | "sbrs" | "sbic" | "sbis" => Some(Effect::Skip),
        "mul" | "muls" | "mulsu" | "fmul" | "fmuls" | "fmulsu" => Some(PRODUCT),
        "add" | "adc" | "sub" | "subi" | "sbc" | "sbci" | "and" | "or" | "eor" | "com" | "neg" | "swap"
        | "inc" | "dec" | "asr" | "lsr" | "ror" | "bld" | "in" | "lds" => change(),
        "ldd" | "ld" if from.starts_with('Y') && from != "Y+" => {
            Some(Effect::LoadAboveY(register(to)?, from.strip_prefix("Y+").map_or(0, number) as u8))
        }
        "ldd" => change(),
        "lpm" | "elpm" if operands.is_empty() => Some(Effect::Other(1)),
        "ld" | "lpm" | "elpm" => Some(Effect::Other(1 << register(to)? | pointer(from))),
        "st" => Some(Effect::Other(pointer(to))),
        "cp" | "cpc" | "cpi" | "std" | "sts" | "bst" | "out" | "sbi" | "cbi" | "nop" | "sleep" | "wdr"
        | "break" => Some(NOTHING),
        "spm" if operands.is_empty() => Some(NOTHING),
        ".word" | "spm" | "des" | "xch" | "las" | "lac" | "lat" => None, // none of the classic AVR
        "brcc" => Some(Effect::BranchIfSameOrHigher(relative())),
        _ if mnemonic.starts_with("br") => Some(Effect::Branch(relative())),
        _ if mnemonic.len() == 3 && mnemonic.starts_with(['s', 'c']) => Some(NOTHING), // a flag
        _ => panic!("{text}: not known to this test"),
    }
}

#[test]
fn what_an_instruction_names() {
    let named = |words: &[u16]| {
        let flash: Vec<_> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        named_address(&flash, 0)
    };
    assert_eq!(named(&[0x9180, 0x0123]), Some(0x123)); // lds r24, 0x123
    assert_eq!(named(&[0x9380, 0x0123]), Some(0x123)); // sts 0x123, r24
    assert_eq!(named(&[0xb124]), Some(0x24)); // in r18, 0x04
    assert_eq!(named(&[0xbf8f]), Some(0x5f)); // out 0x3f, r24
    assert_eq!(named(&[0x9b0f]), Some(0x21)); // sbis 0x01, 7
    assert_eq!(named(&[0x98c4]), Some(0x38)); // cbi 0x18, 4
    assert_eq!(named(&[0x8180]), None); // ld r24, Z
}
