//! The interpreter against simavr's own.

use std::collections::BTreeSet;
use std::sync::Arc;

use simulation::{CLOCK_HZ, Random};
use stack_bound::{instruction, timing};

use super::instruction::decode;
use super::*;
use crate::execution::{self, Watchers};
use crate::image::Image;
use crate::mcu::Mcu;
use crate::part::Part;
use crate::repair::watchdog;

/// What an instruction can change.
#[derive(Debug, PartialEq)]
struct Seen {
    pc: u32,
    cycle: u64,
    status: u8,
    enabled_just_now: bool,
    data: Vec<u8>,
}

impl Seen {
    fn of(cpu: Cpu) -> Self {
        Self {
            pc: cpu.pc(),
            cycle: cpu.cycle(),
            status: cpu.status_register(),
            enabled_just_now: cpu.enabled_just_now(),
            data: cpu.with_data(<[u8]>::to_vec),
        }
    }
}

/// Executes each opcode from states drawn by chance, here and in simavr. Returns how many opcodes the
/// interpreter executed.
fn compare(part: &Part) -> usize {
    const AT: u32 = 0x100;
    let [ours, simavrs] = [(); 2].map(|()| {
        let cpu = Cpu::create(part.name, CLOCK_HZ).expect("simavr has the part");
        watchdog::install(cpu);
        cpu
    });
    let mut random = Random::new(1);
    let mut executed = BTreeSet::new();
    for opcode in 0..=u16::MAX {
        let mut flash = vec![0; 0x400];
        random.fill(&mut flash);
        flash[AT as usize..][..2].copy_from_slice(&opcode.to_le_bytes());
        let program = decode(&flash);
        let mut data = vec![0; ours.data_size()];
        random.fill(&mut data);
        // Pointers lead to registers, into SRAM, or just behind it.
        let pages = (data.len() / 0x100 + 1) as u8;
        for high in [27, 29, 31, usize::from(SPH)] {
            data[high] %= pages;
        }
        for cpu in [ours, simavrs] {
            cpu.reset();
            cpu.load_flash(&flash);
            cpu.with_data_mut(|all| all.copy_from_slice(&data));
            cpu.set_core_state(CoreState { pc: AT, cycle: 0, stop: 1, status: data[usize::from(SREG)] });
        }
        let before = Seen::of(ours);
        if run(ours, &program, &mut ()) {
            executed.insert(opcode);
            execution::run(simavrs, 1, &[], Watchers::default());
            let after = [ours, simavrs].map(Seen::of);
            assert_eq!(after[0], after[1], "{}: {opcode:#06x} from {before:?}", part.name);
            if !has_no_time(opcode) {
                let cycles = tabled(&flash, AT, after[0].pc, ours);
                assert_eq!(Some(after[0].cycle), cycles, "{}: {opcode:#06x}", part.name);
            }
        } else {
            assert_eq!((ours.pc(), ours.cycle()), (AT, 0), "{}: {opcode:#06x}, left to simavr", part.name);
        }
    }
    for cpu in [ours, simavrs] {
        // SAFETY: nobody has a handle but this function, which ends here.
        unsafe { cpu.destroy() }
    }
    executed.len()
}

/// Branches to the next instruction take one cycle or two, and of opcodes that the manual reserves nobody
/// says what they take.
fn has_no_time(opcode: u16) -> bool {
    opcode & 0xfbf8 == 0xf000 || opcode & 0xf808 == 0xf808
}

/// What the table that bounds are computed from says of the instruction there, which led to `next`.
fn tabled(flash: &[u8], at: u32, next: u32, cpu: Cpu) -> Option<u64> {
    let (instruction, _) = instruction::decode(flash, at)?;
    let behind = at + instruction::skipped(flash, at);
    let more = timing::more_cycles(instruction, behind, next);
    let cycles = timing::cycles(flash, at, cpu.return_address_size().into())?;
    Some(u64::from(cycles + more))
}

#[test]
fn each_instruction_does_what_it_does_in_simavr() {
    for part in Part::ALL {
        let executed = compare(part);
        // The rest are no opcodes, are rare, or jump out of this short program.
        assert!(executed > 0xd000, "{}: {executed:#x}", part.name);
    }
}

#[test]
fn programs_run_as_in_simavr() {
    let mut random = Random::new(2);
    for number in 0..200 {
        let mut flash = vec![0; 0x2000];
        random.fill(&mut flash);
        let mut mcus = [true, false].map(|decoded| {
            let image = Arc::new(Image::of_flash(flash.clone(), decoded));
            Mcu::new(Part::ATMEGA128, image, number).expect("the image fits")
        });
        while mcus[0].is_alive() && mcus[0].cycle() < 20_000 {
            let until = mcus[0].cycle() + 1 + random.next_u64() % 200;
            let hashes = mcus.each_mut().map(|mcu| {
                mcu.run_until(until);
                (mcu.state(), mcu.awake_cycles(), mcu.state_hash())
            });
            assert_eq!(hashes[0], hashes[1], "program {number} at {until}");
        }
    }
}
