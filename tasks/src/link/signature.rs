//! How a dock recognises frames of its own.
//!
//! Infrared comes back from any bright surface, so a dock hears what it sent itself. Every frame therefore
//! bears the dock it was sent from and an epoch, a byte that the sender changes from time to time: a frame
//! that bears the dock's own signature is a reflection.
//!
//! A neighbour that is attached by the dock of the same number may bear the same epoch by chance
//! and is then taken for a reflection. Two bytes of seed keep that short: epochs advance by a step
//! that is the end's own, so that two ends which once agree part at the next change of either.

use crate::dock::Dock;

/// The signature that every frame bears: the sending dock and its epoch.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Signature {
    pub dock: Dock,
    pub epoch: u8,
}

/// Signs the frames of one dock.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
pub struct Signer {
    signature: Signature,
    /// Odd, so that all 256 epochs pass before one returns.
    step: u8,
}

impl Signer {
    /// The low byte of `seed` is the first epoch, the high byte decides the step.
    pub const fn new(dock: Dock, seed: u16) -> Signer {
        let [step, epoch] = seed.to_be_bytes();
        Signer { signature: Signature { dock, epoch }, step: step | 1 }
    }

    pub const fn signature(self) -> Signature {
        self.signature
    }

    /// Begins a new epoch.
    pub const fn renew(&mut self) {
        self.signature.epoch = self.signature.epoch.wrapping_add(self.step);
    }

    /// Whether this is the current signature or the one before: a frame may still be on its way
    /// back when its epoch ends.
    pub fn recognises(self, signature: Signature) -> bool {
        let age = self.signature.epoch.wrapping_sub(signature.epoch);
        signature.dock == self.signature.dock && (age == 0 || age == self.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_epoch_returns_after_all_others_only() {
        for seed in [0x0000, 0x0100, 0x7F80, 0xFEFF, 0xFFFF] {
            let mut signer = Signer::new(Dock::Up, seed);
            let mut seen = [false; 256];
            for _ in 0..256 {
                let signature = signer.signature();
                assert_eq!(signature.dock, Dock::Up);
                assert!(!core::mem::replace(&mut seen[usize::from(signature.epoch)], true));
                signer.renew();
            }
            assert_eq!(signer, Signer::new(Dock::Up, seed));
        }
    }

    #[test]
    fn the_current_epoch_and_the_one_before_are_recognised() {
        let mut signer = Signer::new(Dock::Left, 0x04FE);
        let before = signer.signature();
        assert_eq!(before.epoch, 0xFE);
        signer.renew();
        let current = signer.signature();
        assert_eq!(current.epoch, 3, "the step is 5, made odd");
        for epoch in 0..=255 {
            for dock in Dock::ALL {
                let signature = Signature { dock, epoch };
                assert_eq!(signer.recognises(signature), signature == before || signature == current);
            }
        }
    }

    #[test]
    fn two_ends_that_agree_by_chance_part_at_the_next_change() {
        let mut one = Signer::new(Dock::Left, 0x0133);
        let other = Signer::new(Dock::Left, 0x0533);
        assert!(one.recognises(other.signature()));
        one.renew();
        one.renew();
        assert!(!one.recognises(other.signature()));
    }
}
