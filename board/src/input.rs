//! The analog inputs.

/// An analog input.
///
/// 0 to 3 are the potentiometer and current of the joint in this half, then of the roll joint. 4 to 6 are the
/// currents of the docks by place ([`Half::docks`](tasks::superbot::Half::docks)). All these are at the pins
/// ADC0 to ADC6. 8 to 15 are the inputs of the multiplexer, whose output is at ADC7. ADC4 to ADC7 belong to
/// JTAG as long as the fuse JTAGEN is programmed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Input(pub(crate) u8);

impl Input {
    pub(crate) const LAST_OF_JOINTS: u8 = 3;
    pub(crate) const FIRST_DOCK: u8 = 4;
    pub(crate) const MULTIPLEXED: u8 = 8;

    /// The input at pin ADC0 to ADC6.
    pub const fn direct(pin: u8) -> Input {
        assert!(pin < 7, "ADC7 is the multiplexer's");
        Input(pin)
    }

    /// An input of the multiplexer, 0 to 7.
    pub const fn multiplexed(number: u8) -> Input {
        assert!(number < 8, "the multiplexer has eight inputs");
        Input(Self::MULTIPLEXED + number)
    }
}
