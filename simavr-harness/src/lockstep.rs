//! Runs the MCUs that share a bus as if they ran simultaneously.
//!
//! The MCUs take turns and run ahead of each other. None runs past the cycle at which another one's action
//! could reach it: the cycle at which the bus acts next, or the other's next possible action plus the bus's
//! lookahead. An MCU that touches its bus interface stops at once, so that the bus can react. The outcome
//! does not depend on the order and length of the turns, but for one thing: when another MCU sees that SDA,
//! which was held low, is released.

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
