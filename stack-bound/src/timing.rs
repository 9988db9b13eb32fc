//! How long instructions take (ATmega128 datasheet, "Instruction Set Summary"; AVR Instruction Set Manual).

use instruction_set::Instruction::*;

use crate::effect::{Effect, instruction};

/// The cycles of the instruction at an address when the next one follows. A taken branch takes one more, and
/// a skip one for each word that it passes over. `None` if there is no instruction, and for `spm`, which
/// takes as long as the flash does.
///
/// A call pushes `return_address` bytes.
pub fn cycles(flash: &[u8], address: u32, return_address: u16) -> Option<u32> {
    let return_address = u32::from(return_address);
    Some(match instruction(flash, address)? {
        Ldd { .. } | Lds { .. } | LdStep { .. } | Std { .. } | Sts { .. } | StStep { .. } => 2,
        Push { .. } | Pop { .. } | Adiw { .. } | Sbiw { .. } | Cbi { .. } | Sbi { .. } => 2,
        Mul { .. } | Muls { .. } | Mulsu { .. } | FractionalProduct => 2,
        Rjmp { .. } | Ijmp | Eijmp => 2,
        Jmp { .. } | Lpm { .. } | LpmIncrement { .. } | Elpm { .. } | ElpmIncrement { .. } => 3,
        Rcall { .. } | Icall => 1 + return_address,
        Call { .. } | Ret | Reti => 2 + return_address,
        Eicall => 4,
        Spm | Invalid => return None,
        Movw { .. } | Ldi { .. } | Mov { .. } => 1,
        Cpi { .. } | Cp { .. } | Cpc { .. } | Brbs { .. } | Brbc { .. } => 1,
        Subi { .. } | Sbci { .. } | Add { .. } | Adc { .. } | Sub { .. } | Sbc { .. } => 1,
        And { .. } | Or { .. } | Eor { .. } | Andi { .. } | Ori { .. } | Com { .. } | Neg { .. } => 1,
        Inc { .. } | Dec { .. } | Swap { .. } | Asr { .. } | Lsr { .. } | Ror { .. } => 1,
        Bst { .. } | Bld { .. } | Bset { .. } | Bclr { .. } => 1,
        Sbrs { .. } | Sbrc { .. } | Cpse { .. } | Sbis { .. } | Sbic { .. } => 1,
        In { .. } | Out { .. } | Sei | Cli | Nop | Sleep | Wdr | Break => 1,
    })
}

/// How many cycles more the core waits for the EEPROM after the instruction at an address, at most: 4 if it
/// reads a byte, 2 if it begins to write one (ATmega128 datasheet, "EEPROM Read/Write Access").
pub fn waits_for_eeprom(flash: &[u8], address: u32, mcu: Option<&str>) -> u32 {
    const EERE: u8 = 1 << 0;
    const EEWE: u8 = 1 << 1;
    let is_control = |address: u16| eeprom_control(mcu).contains(&address);
    match instruction(flash, address) {
        Some(Out { address, .. }) if is_control(address.into()) => 4,
        Some(Sts { address, .. }) if is_control(address) => 4,
        Some(Sbi { address, mask: EERE }) if is_control(address.into()) => 4,
        Some(Sbi { address, mask: EEWE }) if is_control(address.into()) => 2,
        _ => 0,
    }
}

/// The address of EECR in the data space; both that it may have if the MCU is unknown.
fn eeprom_control(mcu: Option<&str>) -> &'static [u16] {
    match mcu {
        Some("atmega64" | "atmega64a" | "atmega128" | "atmega128a" | "atmega162") => &[0x3c],
        Some(_) => &[0x3f],
        None => &[0x3c, 0x3f],
    }
}

/// How many cycles more an instruction takes if it leads to `to` rather than to the next one, at `behind`.
/// For a branch whose target is the next instruction this is the most.
pub fn more_cycles(effect: Effect, behind: u32, to: u32) -> u32 {
    match effect {
        Effect::Branch(target) | Effect::BranchIfSameOrHigher(target) => u32::from(to == target),
        Effect::Skip => (to - behind) / 2,
        _ => 0,
    }
}

/// Whether the instruction at an address puts the core to sleep until an interrupt comes.
pub fn is_sleep(flash: &[u8], address: u32) -> bool {
    instruction(flash, address) == Some(Sleep)
}

/// Whether the instruction at an address is `reti`, which enables interrupts.
pub fn is_return_from_interrupt(flash: &[u8], address: u32) -> bool {
    instruction(flash, address) == Some(Reti)
}
