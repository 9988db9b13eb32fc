//! Interrupts of any length at any place, while several timers are due at adjacent ticks: no MCU restarts, no
//! stack is used beyond its bound, and timers still expire.
//!
//! `STORM_CYCLES` sets its length, `STORM_SEED` its seed.

use std::path::Path;

use fastrand::Rng;
use superbot_tests_simavr::setting;
use superbot_tests_simavr::stacks::{paint, stacks};
use superbot_tests_simavr::storm::rage;
use superbot_tests_simavr::target::TARGETS;

/// Cycles on each MCU, unless `STORM_CYCLES` says otherwise.
const CYCLES: u64 = 10_000_000;

/// More than three times the length of a round, which takes over 4 ticks.
const CYCLES_OF_A_ROUND: u64 = 20_000;

#[test]
fn no_interrupt_at_any_place_restarts_an_mcu_or_overruns_a_stack() {
    let cycles = setting("STORM_CYCLES").unwrap_or(CYCLES);
    let seed = setting("STORM_SEED").unwrap_or(1);
    for target in TARGETS {
        let notes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../images/stacks.txt");
        let stacks = stacks(target.part, &target.images().join("storm.elf"), Some(&notes));
        let mut mcu = target.mcu(target.image("storm"));
        target.enable_interrupts(&mut mcu);
        paint(&mut mcu, &stacks);

        let rounds = rage(target, &mut mcu, cycles, &mut Rng::with_seed(seed));
        let name = target.part.name;
        println!("{name}: {rounds} rounds in {cycles} cycles");
        assert!(rounds > cycles / CYCLES_OF_A_ROUND, "{name}: {rounds} rounds in {cycles} cycles");
        for stack in &stacks {
            let (used, bound) = (stack.used(&mcu), stack.bound.needs());
            println!("{name}: {:10} {bound:4} {used:4}", stack.name);
            assert!(used <= bound, "{name}: {used} bytes used of {}", stack.bound);
        }
    }
}
