//! Whether code that is not followed enables interrupts.

use std::collections::BTreeSet;

use crate::effect::{self, Effect, effect};
use crate::{Annotations, Image, timing};

/// Whether `sei` or `reti` is reached from the start of a function, through the functions that it calls as
/// well. Of an indirect call or jump only noted callees count.
pub fn enables_interrupts(image: &Image, annotations: &Annotations, entry: u32) -> bool {
    let flash = &image.flash;
    let mut seen = BTreeSet::new();
    let mut due = vec![entry];
    while let Some(address) = due.pop() {
        let Some((effect, length)) = effect(flash, address).filter(|_| seen.insert(address)) else {
            continue;
        };
        let next = address + length;
        let noted = || annotations.calls.get(image.name(address)).into_iter().flatten().copied();
        match effect {
            Effect::EnableInterrupts => return true,
            Effect::Return if timing::is_return_from_interrupt(flash, address) => return true,
            Effect::Return | Effect::Jump(0) => {}
            Effect::Jump(target) => due.push(target),
            Effect::JumpIndirect => due.extend(noted()),
            Effect::CallIndirect => due.extend(noted().chain([next])),
            Effect::Call(target) | Effect::Branch(target) | Effect::BranchIfSameOrHigher(target) => {
                due.extend([target, next]);
            }
            Effect::Skip => due.extend([next, next + effect::length(flash, next)]),
            _ => due.push(next),
        }
    }
    false
}
