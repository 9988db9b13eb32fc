//! The hooks of a module's latches, which do not always take hold.

use crate::random::Random;

/// How often hooks miss a dock that they reach.
#[derive(Clone, Debug)]
pub struct Hooks {
    misses: f64,
    random: Random,
}

impl Default for Hooks {
    /// They never miss.
    fn default() -> Self {
        Self::new(0.0, 0)
    }
}

impl Hooks {
    /// Hooks that miss with the probability `misses`. `seed` decides on each time.
    pub fn new(misses: f64, seed: u64) -> Self {
        Hooks { misses, random: Random::new(seed) }
    }

    /// Whether they take hold this time.
    pub fn take_hold(&mut self) -> bool {
        !self.random.chance(self.misses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hooks_miss_as_often_as_is_said() {
        for (misses, range) in [(0.0, 1_000..=1_000), (0.3, 650..=750), (1.0, 0..=0)] {
            let mut hooks = Hooks::new(misses, 7);
            let held = (0..1_000).filter(|_| hooks.take_hold()).count();
            assert!(range.contains(&held), "{held} of 1,000 at {misses}");
        }
        assert!(Hooks::default().take_hold());
    }
}
