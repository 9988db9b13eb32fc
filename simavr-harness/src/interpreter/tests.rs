//! Compares the interpreter with simavr's own.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;

use simulation::{CLOCK_HZ, Random};
use stack_bound::{effect, timing};

use super::*;
use crate::device::WrappedWrites;
use crate::execution::{self, Watchers};
use crate::image::Image;
use crate::mcu::Mcu;
use crate::part::Part;
use crate::repair::watchdog;

mod devices;

/// What an instruction can change.
#[derive(PartialEq)]
struct Seen {
    pc: u32,
    cycle: u64,
    status: u8,
    enabled_just_now: bool,
    interrupt_waits: bool,
    data: Vec<u8>,
}

/// Prints a hash in place of the data, which are thousands of bytes.
impl fmt::Debug for Seen {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { pc, cycle, status, enabled_just_now, interrupt_waits, data } = self;
        write!(f, "pc {pc:#x}, cycle {cycle}, status {status:#x}, {enabled_just_now}, {interrupt_waits}, ")?;
        write!(f, "registers {:x?}, data {:#x}", &data[..32], simulation::fnv_1a(data.iter().copied()))
    }
}

impl Seen {
    fn of(cpu: Cpu) -> Self {
        Self {
            pc: cpu.pc(),
            cycle: cpu.cycle(),
            status: cpu.status_register(),
            enabled_just_now: cpu.enabled_just_now(),
            interrupt_waits: cpu.interrupt_waits(),
            data: cpu.with_data(<[u8]>::to_vec),
        }
    }
}

/// Values at which carries, signs and overflows change.
const BOUNDARIES: [u8; 6] = [0x00, 0x01, 0x7f, 0x80, 0xfe, 0xff];

/// These three move r0.
const LDS: u16 = 0x9000;
const STS: u16 = 0x9200;
const ST_X: u16 = 0x920c;
const IJMP: u16 = 0x9409;
const RET: u16 = 0x9508;
const ICALL: u16 = 0x9509;
const RETI: u16 = 0x9518;

/// Executes each opcode from random states, here and in simavr. On average every other register holds a
/// boundary value. While interrupts are masked, an interrupt is pending every other time; with interrupts
/// enabled, simavr would look at the core first. Returns how many opcodes the interpreter executed.
fn compare(part: &Part) -> usize {
    const AT: u32 = 0x100;
    let mut wrapped = WrappedWrites::default();
    let [ours, simavrs] = [(); 2].map(|()| {
        let cpu = Cpu::create(part.name, CLOCK_HZ).expect("simavr has the part");
        watchdog::install(cpu, &mut wrapped);
        cpu
    });
    let mut random = Random::new(1);
    let mut executed = BTreeSet::new();
    let (mut known, mut left) = (BTreeSet::new(), Vec::new());
    // For these few opcodes, every state drawn so far may have led out of memory.
    let again = [LDS, STS, ST_X, IJMP, RET, ICALL, RETI].repeat(200);
    for opcode in (0..=u16::MAX).chain(again) {
        let mut flash = vec![0; 0x400];
        random.fill(&mut flash);
        flash[AT as usize..][..2].copy_from_slice(&opcode.to_le_bytes());
        let program = decode(&flash);
        let mut data = vec![0; ours.data_size()];
        random.fill(&mut data);
        for register in &mut data[..32] {
            if random.chance(0.5) {
                *register = BOUNDARIES[random.below(BOUNDARIES.len())];
            }
        }
        // Pointers lead to registers, into SRAM, or just behind it.
        let pages = (data.len() / 0x100 + 1) as u8;
        for high in [27, 29, 31, usize::from(SPH)] {
            data[high] %= pages;
        }
        if random.chance(0.1) {
            // X, Y or Z points to itself.
            let low = 26 + 2 * random.below(3);
            (data[low], data[low + 1]) = ((low + random.below(2)) as u8, 0);
        }
        let is_masked = data[usize::from(SREG)] & INTERRUPT == 0;
        let pending = (is_masked && random.chance(0.5)).then(|| random.below(ours.vectors().count()));
        for cpu in [ours, simavrs] {
            cpu.reset();
            cpu.load_flash(&flash);
            cpu.with_data_mut(|all| all.copy_from_slice(&data));
            cpu.set_core_state(CoreState { pc: AT, cycle: 0, stop: 1, status: data[usize::from(SREG)] });
            if let Some(vector) = pending.and_then(|number| cpu.vectors().nth(number)) {
                let enable = vector.enable_bit();
                cpu.set_bits(enable.address, enable.mask, true);
                cpu.raise(vector);
            }
        }
        let before = Seen::of(ours);
        let instruction = program.get(AT as usize / 2).copied().unwrap_or(Spm);
        if run(ours, &program, &mut ()) {
            executed.insert(opcode);
            known.insert(instruction.number());
            execution::run(simavrs, 1, &[], Watchers::default());
            let after = [ours, simavrs].map(Seen::of);
            assert_eq!(after[0], after[1], "{}: {opcode:#06x} from {before:?}", part.name);
            if !has_no_time(opcode) {
                let cycles = tabled(&flash, AT, after[0].pc, ours);
                assert_eq!(Some(after[0].cycle), cycles, "{}: {opcode:#06x}", part.name);
            }
        } else {
            assert_eq!((ours.pc(), ours.cycle()), (AT, 0), "{}: {opcode:#06x}, left to simavr", part.name);
            left.push(instruction);
        }
    }
    let unknown = |instruction: &Instruction| !known.contains(&instruction.number());
    let forgotten = left.into_iter().filter(unknown).find(|instruction| !is_rare(*instruction));
    assert_eq!(forgotten, None, "{}", part.name);
    for cpu in [ours, simavrs] {
        // SAFETY: only this function has a handle, and it ends here.
        unsafe { cpu.destroy() }
    }
    executed.len()
}

/// Whether the interpreter leaves the instruction to simavr in every state.
fn is_rare(instruction: Instruction) -> bool {
    let is_long =
        matches!(instruction, Elpm { .. } | ElpmIncrement { .. } | FractionalProduct | Eijmp | Eicall);
    is_long || matches!(instruction, Sleep | Wdr | Break | Spm | Invalid)
}

/// Whether the table of cycles does not apply: a branch to the next instruction takes one cycle or two, and
/// the manual gives no cycles for reserved opcodes.
fn has_no_time(opcode: u16) -> bool {
    opcode & 0xfbf8 == 0xf000 || opcode & 0xf808 == 0xf808
}

/// The cycles of the instruction `at` an address, which led to `next`, by the table from which bounds are
/// computed.
fn tabled(flash: &[u8], at: u32, next: u32, cpu: Cpu) -> Option<u64> {
    let (effect, _) = effect::effect(flash, at)?;
    let behind = at + effect::length(flash, at);
    let more = timing::more_cycles(effect, behind, next);
    let cycles = timing::cycles(flash, at, cpu.return_address_size().into())?;
    Some(u64::from(cycles + more))
}

#[test]
fn each_instruction_does_what_it_does_in_simavr() {
    for part in Part::ALL {
        let executed = compare(part);
        // The rest are invalid or rare, or jump out of this short program.
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
