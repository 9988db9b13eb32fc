//! Models, as equations, of what the devices of a module drive and measure: joints with motor and gear, docks
//! with latch and infrared, the battery; and the geometry of its joints and docks.
//!
//! They are for tests on the host and for the simulator, which steps them beside the MCUs. Little of
//! SuperBot's mechanics is published: constants name their source, or are marked as assumed.

pub mod battery;
pub mod dock;
pub mod geometry;
pub mod joint;
pub mod motion;
pub mod motor;
pub mod trouble;
