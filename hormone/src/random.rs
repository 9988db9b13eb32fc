//! Chance for tests: a linear congruence.

pub struct Random(u32);

impl Random {
    pub const fn new(seed: u32) -> Self {
        Random(seed)
    }

    /// A number below this one.
    pub fn below(&mut self, end: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) % end
    }
}
