//! The kernel against a plain reference, written from its documentation.
//!
//! The modules, from the inside out:
//! - [`call`]: kernel calls and what they return, as values.
//! - [`world`]: the kernel's objects, and how each call is made on them. The host test and the test image
//!   share it.
//! - [`wire`]: calls and outcomes as bytes, between the image and the harness.
//! - [`mod@reference`]: what the kernel must do.
//! - [`step`], [`random`], [`systems`] and [`exhaustive`]: scripts.
//! - [`referee`]: compares a kernel that plays a script with the reference.
//! - [`shorten`]: reduces a script that disagrees to the steps that matter.
//!
//! The kernel plays on the host (`kernel/tests/model`) and in simavr (`tests/simavr/src/model`).

#![cfg_attr(target_arch = "avr", no_std)]
#![cfg_attr(
    not(target_arch = "avr"),
    expect(clippy::unit_arg, reason = "a call that returns nothing has an outcome, too")
)]

pub mod call;
pub mod lives;
pub mod parcel;
pub mod wire;
pub mod world;

#[cfg(not(target_arch = "avr"))]
pub mod exhaustive;
#[cfg(not(target_arch = "avr"))]
pub mod random;
#[cfg(not(target_arch = "avr"))]
pub mod referee;
#[cfg(not(target_arch = "avr"))]
pub mod reference;
#[cfg(not(target_arch = "avr"))]
pub mod setup;
#[cfg(not(target_arch = "avr"))]
pub mod shorten;
#[cfg(not(target_arch = "avr"))]
pub mod step;
#[cfg(not(target_arch = "avr"))]
pub mod systems;
