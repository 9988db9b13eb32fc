//! The common part of all ways to simulate a robot: how its modules are joined, and whether they do what is
//! right.
//!
//! - [`Wiring`]: which dock is attached to which. [`Shape`]: wirings by name.
//! - [`Scenario`]: a robot, the [`Terrain`] it is on, and the [`Change`]s that happen to it; from a file or
//!   not.
//! - [`Robot`]: what a robot that runs can be asked for. [`TraceEvent`]: an event of a behaviour, and when.
//! - [`Run`]: a robot on its way through a timeline. [`Observer`] follows trace events: [`Hops`] the hormones
//!   from module to module, [`Discovery`] how soon modules know their neighbours, [`Gait`] what they do.
//!   [`faults`] says what was not as it should be.
//! - [`Body`]: what a module drives and measures. [`Bodies`]: what docks do to each other.
//!   [`Environment`]: a world that a robot may be in.
//! - [`Recorder`]: what is kept of a run, to be looked at later.
//! - [`arq`]: a link's protocol alone, on a line on which anything may happen.
//!
//! All time is in cycles of the robot's clock, 16 MHz, since power-up.

pub mod arq;
mod body;
mod change;
mod command;
mod course;
mod discovery;
mod docking;
mod environment;
mod fault;
mod file;
mod fixed;
mod gait;
mod hardware;
mod hash;
mod hooks;
mod hops;
mod images;
mod leader;
mod native;
mod noise;
mod observer;
mod orders;
mod placing;
mod pose;
mod random;
mod reach;
mod recording;
mod robot;
mod run;
mod scenario;
mod shape;
mod terminal;
mod terrain;
mod totals;
mod trace_event;
mod verdict;
mod walker;
mod wiring;

pub use body::{Body, Drives};
pub use change::{Change, Links, Mcus, PUSH_MILLISECONDS};
pub use command::{SENDS, command};
pub use discovery::Discovery;
pub use docking::Bodies;
pub use environment::Environment;
pub use fault::{JointFault, JointOf};
pub use file::FileError;
pub use gait::Gait;
pub use hardware::{
    CHARACTER, CLOCK_HZ, MILLISECOND, SHARED_LIGHT_LATENESS, START_UP, is_on_pins, is_on_slave, lateness,
};
pub use hash::fnv_1a;
pub use hooks::Hooks;
pub use hops::{Arrival, Hops, LOST_AFTER};
pub use images::OtherImages;
pub use native::Native;
pub use noise::Noise;
pub use observer::Observer;
pub use placing::Placing;
pub use plants::motion::Motion;
pub use plants::trouble::{Moment, Trouble};
pub use pose::{Angles, Facing};
pub use random::Random;
pub use recording::{Loss, Passage, Recorder, Recording, View};
pub use robot::Robot;
pub use run::Run;
pub use scenario::{Event, Forecast, Impossible, Scenario};
pub use shape::{Shape, TooFewModules};
pub use terminal::{Terminal, Transcript};
pub use terrain::{Block, Load, Stair, Terrain, Wall};
pub use totals::{BridgeTotals, LinkTotals};
pub use trace_event::TraceEvent;
pub use verdict::faults;
pub use walker::{Violation, Wrong};
pub use wiring::{Face, Wiring, WiringError};
