//! Lists the cycles of a figure, instruction by instruction.

use std::path::Path;

use super::interrupts::BUTTON;
use super::{BenchError, Stretch, TestImages};

/// An instruction of a stretch, or the response to an interrupt.
#[derive(Clone, Debug)]
pub struct Step {
    /// Cycles from the beginning of the stretch.
    pub at: u64,
    pub cycles: u64,
    /// Address of the instruction in bytes; `None` for the response to an interrupt.
    pub pc: Option<u32>,
}

/// Runs the stretch again, one instruction at a time.
///
/// # Errors
/// The image in `directory` is no longer there.
pub fn listing(directory: &Path, stretch: &Stretch) -> Result<Vec<Step>, BenchError> {
    let mut mcu = TestImages { directory }.mcu(&stretch.image)?;
    mcu.run_until(stretch.cycles.start);
    let mut steps = Vec::new();
    let mut begin = stretch.cycles.start;
    let mut note = |pc, end| {
        if end > begin {
            steps.push(Step { at: begin - stretch.cycles.start, cycles: end - begin, pc });
        }
        begin = end;
    };
    if stretch.begins_with_press {
        mcu.drive_pin(BUTTON, true);
    }
    note(None, mcu.cycle()); // an interrupt accepted as the stretch begins
    while mcu.cycle() < stretch.cycles.end && mcu.is_alive() {
        let pc = mcu.pc();
        let response = mcu.step().map_or(0, |accepted| accepted.response_cycles);
        note(Some(pc), mcu.cycle() - response);
        note(None, mcu.cycle());
    }
    Ok(steps)
}
