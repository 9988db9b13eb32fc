//! Distributed control without IDs (paper, sections 6 and 7).
//!
//! Every module of a robot runs the same three behaviours. AC_SEND probes the six docks. AC_RECV derives the
//! topology from the probes it hears. HORMONE acts on topology, local timer and received hormones by a table
//! of receptor rules, and propagates hormones. No module has an ID: what a module does follows from how it is
//! attached.
//!
//! What they are built from:
//! - AC_SEND: [`schedule`], [`probe`].
//! - AC_RECV: [`topology`], [`neighbours`], [`probe`].
//! - HORMONE: [`controller`]: [`module_type`], [`pacemaker`], [`election`], [`order`], [`standing`],
//!   [`sense`], the [`rule`]s of a [`mod@gait`].
//!
//! All but [`task`] is pure: it knows no clock, queue or device. The caller passes the time in, milliseconds
//! in a `u16` that wraps (see [`time`]), and carries out what comes back. [`behaviours`] has the three as
//! state machines over messages; [`task`] drives each by a task of its own and the kernel's clock.
#![cfg_attr(not(test), no_std)]

pub mod action;
pub mod behaviours;
pub mod case;
pub mod controller;
pub mod data;
pub mod election;
pub mod event;
pub mod gait;
pub mod hormone;
pub mod module;
pub mod module_type;
pub mod neighbours;
pub mod order;
pub mod pace;
pub mod pacemaker;
pub mod period;
pub mod probe;
pub mod rows;
pub mod rule;
pub mod schedule;
pub mod sense;
pub mod standing;
pub mod status;
pub mod table;
pub mod task;
pub mod time;
pub mod topology;

#[cfg(test)]
mod random;
