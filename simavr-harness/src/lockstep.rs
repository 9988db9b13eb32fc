//! Runs the MCUs that share a bus as if they ran at once.
//!
//! One after the other they run ahead, none further than an action of another could reach it: the
//! cycle at which the bus acts next, or the other's next possible action and the bus's lookahead. An
//! MCU that touches its bus interface stops at once, so that the bus knows. The outcome is the same
//! for whatever order and length of turns.

use crate::bus::Bus;
use crate::mcu::Mcu;

/// Runs all of `mcus` up to `target`. `quantum` is the longest turn in cycles; it changes the speed
/// only.
pub fn run_until(mcus: &mut [Mcu], bus: &mut Bus, target: u64, quantum: u64) {
    loop {
        bus.advance(mcus);
        let limit = bus.due().unwrap_or(u64::MAX).min(target);
        let behind = |mcu: &Mcu| mcu.is_alive() && mcu.cycle() < limit;
        let last = (0..mcus.len()).filter(|&i| behind(&mcus[i])).min_by_key(|&i| mcus[i].cycle());
        let Some(last) = last else { return };
        let others = mcus.iter().enumerate().filter(|&(index, _)| index != last);
        let earliest = others.map(|(_, other)| other.earliest_action()).min().unwrap_or(u64::MAX);
        let horizon = earliest.saturating_add(bus.lookahead());
        let turn = mcus[last].cycle().saturating_add(quantum);
        mcus[last].run_slice(limit.min(horizon).min(turn));
    }
}
