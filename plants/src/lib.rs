//! What the devices of a module drive and measure, as equations: joints with motor and gear, docks with latch
//! and infrared, the battery; and where its joints and docks are.
//!
//! For tests on the host and for the simulator, which steps these beside the MCUs. Of SuperBot's mechanics
//! little is published; constants say where they come from, and what is assumed says so.

pub mod battery;
pub mod dock;
pub mod geometry;
pub mod joint;
pub mod motion;
pub mod motor;
pub mod trouble;
