//! Events of behaviours, with their time and place.

use hormone::event::Event;

/// An event that a behaviour has told of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceEvent {
    /// In cycles since power-up.
    pub cycle: u64,
    /// The module's index.
    pub module: usize,
    pub event: Event,
}
