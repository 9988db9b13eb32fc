//! The debugging information in an object file, the only one that has any.

use std::error::Error;

use object::elf::{self, FileHeader32, Rela32, SectionHeader32, Sym32};
use object::read::elf::{FileHeader, Rela, SectionHeader, Sym};
use object::{Endianness, pod};

/// The prefix of sections of debugging information; the kernel's records of its tasks are none.
const DEBUG: &[u8] = b".debug_";
const TASKS: &[u8] = b".debug_tasks";

/// A change to the bytes of the file.
enum Change {
    Word(usize, u32),
    Relocation(usize, Rela32<Endianness>),
}

/// Resolves references from debugging information to debugging information, and redirects references to a
/// `ret` that the linker may remove to the instruction before.
///
/// # Errors
/// The bytes are no object file for the AVR in the form that LLVM writes.
pub fn settle(bytes: &mut [u8]) -> Result<(), Box<dyn Error>> {
    for change in changes(bytes)? {
        match change {
            Change::Word(at, word) => bytes[at..at + 4].copy_from_slice(&word.to_le_bytes()),
            Change::Relocation(at, relocation) => {
                let new = pod::bytes_of(&relocation);
                bytes[at..at + new.len()].copy_from_slice(new);
            }
        }
    }
    Ok(())
}

fn changes(bytes: &[u8]) -> Result<Vec<Change>, Box<dyn Error>> {
    let endian = Endianness::Little;
    let header = FileHeader32::<Endianness>::parse(bytes)?;
    if header.e_machine(endian) != elf::EM_AVR {
        return Err("it is not for the AVR".into());
    }
    let sections = header.sections(endian, bytes)?;
    let symbols = sections.symbols(endian, bytes, elf::SHT_SYMTAB)?;
    let is_debugging = |section: &SectionHeader32<Endianness>| {
        sections.section_name(endian, section).is_ok_and(|name| name.starts_with(DEBUG) && name != TASKS)
    };
    let mut changes = Vec::new();
    for section in sections.iter() {
        if is_debugging(section) && section.sh_flags(endian) & (elf::SHF_MERGE | elf::SHF_STRINGS) != 0 {
            // Without these flags the linker does not merge strings, so they keep their offsets.
            let flags = section.sh_flags(endian) & !(elf::SHF_MERGE | elf::SHF_STRINGS);
            let at = pod::bytes_of(section).as_ptr() as usize - bytes.as_ptr() as usize;
            changes.push(Change::Word(at + FLAGS, flags));
        }
        let Some((relocations, _)) = section.rela(endian, bytes)? else { continue };
        let target = sections.section(section.info_link(endian))?;
        if !is_debugging(target) {
            continue;
        }
        for (number, relocation) in relocations.iter().enumerate() {
            let at = section.sh_offset(endian) as usize + number * size_of::<Rela32<Endianness>>();
            let Some(symbol) = relocation.symbol(endian, false) else { continue };
            let symbol: &Sym32<Endianness> = symbols.symbol(symbol)?;
            let Ok(of) = sections.section(object::SectionIndex(symbol.st_shndx(endian).into())) else {
                continue;
            };
            let place = symbol.st_value(endian).wrapping_add_signed(relocation.r_addend(endian));
            if is_debugging(of) {
                if relocation.r_type(endian) != elf::R_AVR_32 {
                    return Err("a reference within debugging information does not have 32 bits".into());
                }
                let word = target.sh_offset(endian) as usize + relocation.r_offset(endian) as usize;
                changes.push(Change::Word(word, place));
                let mut nothing = *relocation;
                nothing.r_info.set(endian, 0);
                nothing.r_addend.set(endian, 0);
                changes.push(Change::Relocation(at, nothing));
            } else if let Some(back) = to_call_before_return(of.data(endian, bytes)?, place as usize) {
                let mut earlier = *relocation;
                earlier.r_addend.set(endian, relocation.r_addend(endian) - back);
                changes.push(Change::Relocation(at, earlier));
            }
        }
    }
    Ok(changes)
}

/// The offset of the flags in a section's header.
const FLAGS: usize = 8;

/// How many bytes before a `ret` the call or jump before it begins. The linker turns a call there into a
/// jump, and removes the `ret`.
fn to_call_before_return(code: &[u8], at: usize) -> Option<i32> {
    let word = |at: usize| Some(u16::from_le_bytes(code.get(at..at + 2)?.try_into().ok()?));
    if word(at)? != 0x9508 {
        return None;
    }
    if at.checked_sub(2).and_then(word).is_some_and(|word| word & 0xe000 == 0xc000) {
        return Some(2); // rjmp, rcall
    }
    at.checked_sub(4).and_then(word).filter(|word| word & 0xfffc == 0x940c).map(|_| 4) // jmp, call
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_return_behind_a_call_or_a_jump_may_go() {
        let code = |words: &[u16]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
        let back = |words: &[u16]| to_call_before_return(&code(words), 2 * (words.len() - 1));
        assert_eq!(back(&[0xd123, 0x9508]), Some(2), "rcall");
        assert_eq!(back(&[0xc123, 0x9508]), Some(2), "rjmp");
        assert_eq!(back(&[0x940e, 0x0123, 0x9508]), Some(4), "call");
        assert_eq!(back(&[0x940c, 0x0123, 0x9508]), Some(4), "jmp");
        assert_eq!(back(&[0x0000, 0x0123, 0x9508]), None, "another instruction");
        assert_eq!(back(&[0xd123, 0x9518]), None, "another return");
        assert_eq!(back(&[0x9508]), None, "nothing before");
    }
}
