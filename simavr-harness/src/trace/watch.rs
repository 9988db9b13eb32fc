//! Selects the instructions and the registers that are watched.

use instruction_set::Instruction::{self, *};
use instruction_set::Step;

use crate::cpu::Cpu;
use crate::image::{Image, Place};
use crate::interpreter;
use crate::joint_pins::{ICR1, JOINTS, PORTC, TCCR1A, TCCR1B};
use crate::trace::NotTraceable;

/// The compare registers of the joints: that of the joint of each half, and that of the roll joint.
const HALF: u16 = JOINTS[0].compare;
const ROLL: u16 = JOINTS[1].compare;

/// The registers by which a program drives the joints' motors, as low and high byte where they have two.
pub(super) const REGISTERS: [u16; 9] =
    [TCCR1A, TCCR1B, PORTC, ICR1, ICR1 + 1, HALF, HALF + 1, ROLL, ROLL + 1];

/// The meaning of an instruction to the tracer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    Nothing,
    /// It stores a byte in the data space.
    Store,
    /// It writes an I/O register, or a bit of it.
    Output,
    /// It returns from an interrupt.
    Return,
    Sleep,
    /// The kernel begins to save the rest of a preempted task's context.
    Save,
    /// The kernel turns to the task that should run.
    Switch,
}

/// A program and the meanings of its instructions, by words of flash.
pub(super) struct Watch {
    program: Vec<Instruction>,
    meanings: Vec<Meaning>,
}

impl Watch {
    pub fn of(image: &Image) -> Result<Self, NotTraceable> {
        let program = interpreter::decode(image.flash());
        let mut meanings: Vec<Meaning> = program.iter().map(meaning).collect();
        let of_kernel = [
            ("save", Meaning::Save),
            ("kernel_run_head", Meaning::Switch),
            ("preempted_goes_on", Meaning::Return),
        ];
        // A tick that only counts returns there, in a program whose kernel has ticks.
        let tick = ("tick_goes_on", Meaning::Return);
        let of_tick = image.symbol(tick.0).map(|_| tick);
        for (name, meaning) in of_kernel.into_iter().chain(of_tick) {
            let Some(Place::Flash(address)) = image.symbol(name).map(|symbol| symbol.place) else {
                return Err(NotTraceable(name));
            };
            // At the kernel's labels there is no instruction with a meaning of its own, which would be lost.
            match meanings.get_mut(address as usize / 2) {
                Some(word) if *word == Meaning::Nothing => *word = meaning,
                _ => return Err(NotTraceable(name)),
            }
        }
        Ok(Self { program, meanings })
    }

    /// The meaning of the instruction at a word.
    #[inline(always)]
    pub fn meaning(&self, at: u32) -> Meaning {
        self.meanings.get(at as usize).copied().unwrap_or(Meaning::Nothing)
    }

    /// The address to which the instruction at a word, the last that was executed, has stored.
    pub fn stored_at(&self, cpu: Cpu, at: u32) -> Option<u16> {
        let pair = |low: u8| u16::from_le_bytes([cpu.data(low.into()), cpu.data(u16::from(low) + 1)]);
        Some(match *self.program.get(at as usize)? {
            Std { pointer, displacement, .. } => pair(pointer).wrapping_add(displacement.into()),
            Sts { address, .. } => address,
            StStep { pointer, step: Step::On, .. } => pair(pointer).wrapping_sub(1),
            StStep { pointer, step: Step::Back, .. } => pair(pointer),
            Out { address, .. } | Sbi { address, .. } | Cbi { address, .. } => address.into(),
            _ => return None,
        })
    }
}

fn meaning(instruction: &Instruction) -> Meaning {
    match *instruction {
        Std { .. } | Sts { .. } | StStep { .. } => Meaning::Store,
        Reti => Meaning::Return,
        Sleep => Meaning::Sleep,
        Out { address, .. } | Sbi { address, .. } | Cbi { address, .. }
            if REGISTERS.contains(&address.into()) =>
        {
            Meaning::Output
        }
        _ => Meaning::Nothing,
    }
}
