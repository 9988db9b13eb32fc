//! The tasks of an MCU's devices besides links, bus and the joints' control: docking motors, guidance,
//! sensors, power.
//!
//! Each is a small state machine that takes requests and is stepped, and runs to completion: they share one
//! stack, one mailbox and one [task](task). Stacks of their own would take about 200 bytes each, and there
//! are ten of these tasks on the master.
//!
//! | file | what |
//! |---|---|
//! | [`task`] | hands requests to the devices, steps them, sleeps as long as none has anything to do |
//! | [`desk`] | who asked, and how reports get there |
//! | [`docks`] | the docking motors, guidance and power switches of three docks |
//! | [`sensors`] | readings on demand |
//! | [`supply`] | the battery and its charger, on the MCU that has them |

pub mod desk;
pub mod docks;
pub mod sensors;
pub mod supply;
pub mod task;
