//! How long instructions take (ATmega128 datasheet, "Instruction Set Summary"; AVR Instruction Set Manual).

use instruction_set::{Arithmetic, Bits, Flow, Instruction, Jump, Rare, Special, Sum, Transfer};

use crate::effect::{Effect, instruction};

/// What the instruction at an address takes, in cycles, where the next one follows: a branch that is taken
/// takes one more, and a skip one for each word that it passes over. `None` where there is no instruction,
/// and for `spm`, which takes as long as the flash does.
///
/// A call pushes `return_address` bytes.
pub fn cycles(flash: &[u8], address: u32, return_address: u16) -> Option<u32> {
    let return_address = return_address.into();
    Some(match instruction(flash, address)? {
        Instruction::Transfer(Transfer::Move(_)) => 1,
        Instruction::Transfer(Transfer::Memory(_) | Transfer::Stack(_)) => 2,
        Instruction::Arithmetic(Arithmetic::Sum(Sum::Adiw { .. } | Sum::Sbiw { .. })) => 2,
        Instruction::Arithmetic(Arithmetic::Bits(
            Bits::Mul { .. } | Bits::Muls { .. } | Bits::Mulsu { .. },
        )) => 2,
        Instruction::Arithmetic(_) | Instruction::Flow(Flow::Branch(_)) => 1,
        Instruction::Flow(Flow::Jump(Jump::Rjmp { .. } | Jump::Ijmp)) => 2,
        Instruction::Flow(Flow::Jump(Jump::Jmp { .. })) => 3,
        Instruction::Flow(Flow::Special(special)) => of_special(special, return_address)?,
    })
}

fn of_special(special: Special, return_address: u32) -> Option<u32> {
    Some(match special {
        Special::Rcall { .. } | Special::Icall => 1 + return_address,
        Special::Call { .. } | Special::Ret | Special::Reti => 2 + return_address,
        Special::Cbi { .. } | Special::Sbi { .. } => 2,
        Special::Lpm { .. } | Special::LpmIncrement { .. } => 3,
        Special::Rare(rare) => match rare {
            Rare::Elpm { .. } | Rare::ElpmIncrement { .. } => 3,
            Rare::FractionalProduct | Rare::Eijmp => 2,
            Rare::Eicall => 4,
            Rare::Sleep | Rare::Wdr | Rare::Break => 1,
            Rare::Spm | Rare::None => return None,
        },
        Special::Sbrs { .. }
        | Special::Sbrc { .. }
        | Special::Cpse { .. }
        | Special::Sbis { .. }
        | Special::Sbic { .. }
        | Special::In { .. }
        | Special::Out { .. }
        | Special::Sei
        | Special::Cli
        | Special::Nop => 1,
    })
}

/// How many cycles more an instruction takes that leads to `to` rather than to the next one, at `behind`: at
/// most, for a branch that leads there either way.
pub fn more_cycles(effect: Effect, behind: u32, to: u32) -> u32 {
    match effect {
        Effect::Branch(target) | Effect::BranchIfSameOrHigher(target) => u32::from(to == target),
        Effect::Skip => (to - behind) / 2,
        _ => 0,
    }
}

/// Whether the core sleeps from the instruction at an address on, until an interrupt comes.
pub fn is_sleep(flash: &[u8], address: u32) -> bool {
    instruction(flash, address) == Some(Rare::Sleep.into())
}

/// Whether that is `reti`, which enables interrupts.
pub fn is_return_from_interrupt(flash: &[u8], address: u32) -> bool {
    instruction(flash, address) == Some(Special::Reti.into())
}
