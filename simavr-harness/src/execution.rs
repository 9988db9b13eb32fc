//! Executes a program. The [`interpreter`] of the harness executes the instructions that it supports,
//! simavr's own the rest.

use instruction_set::Instruction;

use crate::coverage::Coverage;
use crate::cpu::Cpu;
use crate::interpreter::{self, Note, Now};
use crate::trace::Tracer;

/// The observers of each instruction.
#[derive(Default)]
pub(crate) struct Watchers<'a> {
    pub coverage: Option<&'a Coverage>,
    pub tracer: Option<&'a mut Tracer>,
}

impl Watchers<'_> {
    fn is_none(&self) -> bool {
        self.coverage.is_none() && self.tracer.is_none()
    }
}

/// The watchers of one core.
struct Notes<'a> {
    cpu: Cpu,
    watchers: Watchers<'a>,
}

impl Note for Notes<'_> {
    #[inline(always)]
    fn note(&mut self, at: u32, now: &Now) {
        let Watchers { coverage, tracer } = &mut self.watchers;
        if let Some(coverage) = coverage {
            coverage.note(at, now.next());
        }
        if let Some(tracer) = tracer {
            tracer.note(self.cpu, at, now);
        }
    }
}

/// Executes instructions until `deadline`, the next cycle timer, an interrupt to be served, a sleep or a
/// device's call for attention, whichever comes first; at least one instruction. `program` is what is in
/// flash, as far as it is decoded.
pub(crate) fn run(cpu: Cpu, deadline: u64, program: &[Instruction], watchers: Watchers) {
    let may_run = !cpu.begin_run(deadline);
    if watchers.is_none() {
        if !may_run || !interpreter::run(cpu, program, &mut ()) {
            cpu.run_by_simavr();
        }
        return;
    }
    let mut notes = Notes { cpu, watchers };
    if may_run && interpreter::run(cpu, program, &mut notes) {
        return;
    }
    let at = cpu.pc() / 2;
    cpu.run_for_one_instruction(); // so that each one is noted
    cpu.run_by_simavr();
    notes.note(at, &Now::load(cpu));
}
