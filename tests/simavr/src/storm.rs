//! Interrupts at random places, for the image `storm`.

use fastrand::Rng;
use simavr_harness::Mcu;

use crate::target::Target;

/// The image's mark at its start.
pub const BOOTED: u8 = 1;
/// Its mark of a round.
const ROUND: u8 = 2;

/// Raises interrupts until so many cycles have passed since power-up. Returns how many rounds the image has
/// made.
///
/// # Panics
/// When the program restarts, ends, or finds something wrong.
pub fn rage(target: &Target, mcu: &mut Mcu, cycles: u64, random: &mut Rng) -> u64 {
    let mut rounds = 0;
    let mut boots = 0;
    while mcu.cycle() < cycles {
        // Sometimes the next interrupt comes while the last is served and timers expire.
        let most = *random.choice(&[8, 60, 300, 1500]).expect("it is not empty");
        mcu.run_until(mcu.cycle() + random.u64(1..=most));
        let interrupt = if random.bool() { &target.tick } else { &target.external };
        assert!(mcu.raise_interrupt(interrupt.vector), "it has that interrupt");
        for mark in mcu.take_markers() {
            match mark.value {
                BOOTED => boots += 1,
                ROUND => rounds += 1,
                wrong => panic!("{}: mark {wrong:#x} at cycle {}", target.part.name, mark.cycle),
            }
        }
        let reason = mcu.crash_reason().unwrap_or("it has ended");
        assert!(mcu.is_alive(), "{}: {reason}, at cycle {}", target.part.name, mcu.cycle());
        assert!(boots <= 1, "{} restarts before cycle {}", target.part.name, mcu.cycle());
    }
    rounds
}
