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
    use std::io::Write;
    use std::process::{Command, Stdio};

    const SOURCE: &str = r#"
        .section .text.code,"ax",@progbits
call:   call    call
        ret
jump:   rjmp    jump
        ret
plain:  nop
        ret
        .section .debug_str,"eMS",@progbits,1
        .string "1"
second: .string "2"
        .section .debug_info,"",@progbits
        .long   call, second, call + 4, jump + 2, plain + 2
        .section .debug_tasks,"MS",@progbits,1
        .long   second, call + 4
        .section .data.table,"aw",@progbits
        .long   second, call + 4
        .section .rodata.str,"aMS",@progbits,1
        .string "3"
    "#;

    fn assembled(source: &str) -> Vec<u8> {
        let file = tempfile::NamedTempFile::new().expect("a place for it");
        let mut assembler = Command::new("avr-as");
        assembler.arg("-mmcu=atmega128").arg("-o").arg(file.path());
        let mut child = assembler.stdin(Stdio::piped()).spawn().expect("avr-as runs");
        child.stdin.take().expect("a pipe").write_all(source.as_bytes()).expect("it reads");
        assert!(child.wait().expect("it ends").success());
        std::fs::read(file.path()).expect("it was written")
    }

    /// What is said of a section: its flags, its words, and its references, each by type, place and addend.
    type Said = (u32, Vec<u32>, Vec<(u32, u32, i32)>);

    fn said(bytes: &[u8], name: &str) -> Said {
        let endian = Endianness::Little;
        let header = FileHeader32::<Endianness>::parse(bytes).expect("an object file");
        let sections = header.sections(endian, bytes).expect("its sections");
        let (index, section) = sections.section_by_name(endian, name.as_bytes()).expect("the section");
        let words = section.data(endian, bytes).expect("its bytes").chunks_exact(4);
        let words = words.map(|word| u32::from_le_bytes(word.try_into().expect("four")));
        let relocations = sections.iter().filter(|of| of.info_link(endian) == index);
        let relocations = relocations.filter_map(|of| of.rela(endian, bytes).expect("references"));
        let references = relocations.flat_map(|(all, _)| all).map(|reference| {
            let [kind, place] = [reference.r_type(endian), reference.r_offset(endian)];
            (kind, place, reference.r_addend(endian))
        });
        (section.sh_flags(endian), words.collect(), references.collect())
    }

    /// References of debugging information alone change: those to debugging information, and those to a
    /// return that may go.
    #[test]
    fn what_debugging_information_refers_to_is_settled() {
        const STRINGS: u32 = elf::SHF_MERGE | elf::SHF_STRINGS;
        const WRITTEN: u32 = elf::SHF_ALLOC | elf::SHF_WRITE;
        let to = |place, addend| (elf::R_AVR_32, place, addend);
        let mut bytes = assembled(SOURCE);
        let before = said(&bytes, ".debug_info");
        let all = [to(0, 0), to(4, 2), to(8, 4), to(12, 8), to(16, 12)];
        assert_eq!(before, (0, vec![0; 5], all.to_vec()));
        settle(&mut bytes).expect("an object file for the AVR");
        for (name, flags, words, references) in [
            (".debug_str", elf::SHF_EXCLUDE, &[0x0032_0031][..], &[][..]),
            (
                ".debug_info",
                0,
                &[0, 2, 0, 0, 0],
                &[to(0, 0), (elf::R_AVR_NONE, 4, 0), to(8, 0), to(12, 6), to(16, 12)],
            ),
            (".debug_tasks", STRINGS, &[0, 0], &[to(0, 2), to(4, 4)]),
            (".data.table", WRITTEN, &[0, 0], &[to(0, 2), to(4, 4)]),
            (".rodata.str", elf::SHF_ALLOC | STRINGS, &[], &[]),
        ] {
            assert_eq!(said(&bytes, name), (flags, words.to_vec(), references.to_vec()), "{name}");
        }
    }

    #[test]
    fn what_it_does_not_understand_is_refused() {
        let narrow = SOURCE.replace(".long   call, second", ".word   call, second");
        let error = settle(&mut assembled(&narrow)).expect_err("it would be wrong").to_string();
        assert_eq!(error, "a reference within debugging information does not have 32 bits");
        let mut other = assembled(SOURCE);
        other[18] += 1; // the machine
        let error = settle(&mut other).expect_err("it is another").to_string();
        assert_eq!(error, "it is not for the AVR");
        assert!(settle(&mut []).is_err());
    }

    #[test]
    fn a_return_behind_a_call_or_a_jump_may_go() {
        let code = |words: &[u16]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
        let back = |words: &[u16]| to_call_before_return(&code(words), 2 * (words.len() - 1));
        assert_eq!(back(&[0xd123, 0x9508]), Some(2), "rcall");
        assert_eq!(back(&[0xc123, 0x9508]), Some(2), "rjmp");
        assert_eq!(back(&[0x940e, 0x0123, 0x9508]), Some(4), "call");
        assert_eq!(back(&[0x940c, 0x0123, 0x9508]), Some(4), "jmp");
        assert_eq!(back(&[0x940d, 0x0123, 0x9508]), Some(4), "jmp, beyond 128 KiB");
        assert_eq!(back(&[0x0000, 0x0123, 0x9508]), None, "another instruction");
        assert_eq!(back(&[0xd123, 0x9518]), None, "another return");
        assert_eq!(back(&[0x9508]), None, "nothing before");
    }
}
