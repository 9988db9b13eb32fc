//! Executes a program: by the [`interpreter`] of the harness what that knows, by simavr's own the rest.

use crate::coverage::Coverage;
use crate::cpu::Cpu;
use crate::interpreter::instruction::Instruction;
use crate::interpreter::{self, Trace};

/// Executes instructions until `deadline`, the next cycle timer, an interrupt to be served, a sleep or a
/// device's call for attention, whichever comes first; at least one instruction. `program` is what is in
/// flash, as far as it is decoded; `coverage` takes note of each instruction.
pub(crate) fn run(cpu: Cpu, deadline: u64, program: &[Instruction], coverage: Option<&Coverage>) {
    let has_run = !cpu.begin_run(deadline)
        && match coverage {
            None => interpreter::run(cpu, program, &()),
            Some(coverage) => interpreter::run(cpu, program, coverage),
        };
    if has_run {
        return;
    }
    let Some(coverage) = coverage else { return cpu.run_by_simavr() };
    let at = cpu.pc();
    cpu.run_for_one_instruction(); // of which note is taken
    cpu.run_by_simavr();
    coverage.note(at / 2, cpu.pc() / 2);
}
