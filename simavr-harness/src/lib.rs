//! Modules of a SuperBot in simavr: both MCUs of each run their real images, cycle by cycle.
//!
//! From the inside out:
//! - [`Mcu`]: one ATmega128 with an [`Image`], by itself. Programs report to the harness through
//!   [`Marker`]s. `repair` corrects simavr where it differs from the datasheet. An image may
//!   record its [`Coverage`].
//! - [`Bus`] and [`lockstep`]: MCUs that share a two-wire bus.
//! - [`Module`]: a master and a slave on a bus, the docks that their USARTs serve, and the [`Body`] that they
//!   move.
//! - [`Robot`]: modules, and which dock is attached to which.
//! - `physics`: the [world] that a robot may be in.
//! - [`Engine`]: runs a robot on a given number of threads.
//! - [`mod@bench`]: the kernel's figures, measured on single MCUs, and those of a module.
//!
//! All times are in cycles of the 16 MHz clock since power-up. The outcome depends on the images,
//! the wiring and the seed, and on nothing else.

mod behaviour;
pub mod bench;
mod body_pins;
mod bus;
mod character;
mod counters;
mod coverage;
mod cpu;
mod device;
mod docking;
mod engine;
mod execution;
mod image;
mod inspect;
mod interpreter;
mod joint_pins;
mod link;
pub mod lockstep;
mod marker;
mod mcu;
mod module;
mod part;
mod physics;
mod probe;
mod repair;
mod robot;
mod rounds;
mod serial_pins;
mod shares;
mod terrain;
mod tilt;
mod trace;
mod variation;
mod wires;

pub use bus::{Bus, BusCounts};
pub use character::Character;
pub use coverage::{Coverage, Ways};
pub use cpu::{Registers, Reset};
pub use engine::Engine;
pub use image::{Code, Form, Image, ImageError, Kind, Place, Symbol};
pub use inspect::{Context, Tasks};
pub use link::{Faults, LinkCounts};
pub use marker::Marker;
pub use mcu::job::LongestJob;
pub use mcu::masked::{MaskedWindow, OpenedBy};
pub use mcu::{Accepted, Debugger, Mcu, McuError, NoSuchData, State};
pub use module::{CONTROL_PROBE, Images, Module, NoLink};
pub use part::{Part, Pin, UnknownPart};
pub use physics::Physics;
pub use probe::Edge;
pub use repair::adc::{Analog, Multiplexer};
pub use repair::spm::WhileWriting;
pub use repair::usart::UsartCounts;
pub use robot::{Event, Robot, RobotBuilder, RobotError};
pub use serial_pins::{SerialPinCounts, SerialPins};
pub use simulation::{Body, CLOCK_HZ, Face, Terrain, Wiring, WiringError};
/// Renamed, because `Mcu` in this crate is a simulated microcontroller.
pub use tasks::router::Mcu as Controller;
pub use terrain::ground;
pub use trace::{BusSignal, Line, bus_lines, motor_lines, serial_line};
pub use trace::{Holder, NotTraceable, SerialTrace, Slice, TaskState, TaskTrace, Trace, Wait};
pub use variation::{Assumption, Variation, VariationError};
pub use world::{Ground, Steps};
