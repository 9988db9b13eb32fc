//! What behaviours did.

use hormone::event::Event;

/// Something that a behaviour did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deed {
    /// In cycles since power-up.
    pub cycle: u64,
    /// The module's index.
    pub module: usize,
    pub event: Event,
}
