//! What a module does with its motors (paper, section 7).

/// A local action.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(u8)]
pub enum Action {
    /// All motors at 0 degrees.
    Straight = 0,
    /// Lift the leg, swing it forward, put it down.
    Swing = 1,
    /// Hold the leg on the ground while the hip turns back under the swing of the others.
    Holding = 2,
    /// Keep still: the safe action of a module that no rule has told what to do.
    Rest = 3,
}

impl Action {
    /// The action with code `byte`, as [`Status`](crate::status::Status) carries it.
    pub const fn from_byte(byte: u8) -> Option<Action> {
        match byte {
            0 => Some(Action::Straight),
            1 => Some(Action::Swing),
            2 => Some(Action::Holding),
            3 => Some(Action::Rest),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_action_survives_its_byte() {
        for byte in 0..=u8::MAX {
            assert_eq!(Action::from_byte(byte).map(|action| action as u8), (byte < 4).then_some(byte));
        }
    }
}
