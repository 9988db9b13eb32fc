//! The system tasks of a SuperBot module (paper, sections 4 and 5).
//!
//! Most of it is pure: state machines, codecs and decisions that take bytes and events in and give
//! values out. The tasks are thin loops around them; their devices are behind the traits of [`device`].
//!
//! | module      | what it decides                                                      |
//! |-------------|----------------------------------------------------------------------|
//! | [`dock`]    | the six docks and sets of them                                       |
//! | [`message`] | what tasks send one another, and how a task is addressed             |
//! | [`link`]    | how a message crosses a dock: framing, CRC, stop-and-wait ARQ        |
//! | [`bridge`]  | how a message crosses from one MCU of a module to the other          |
//! | [`superbot`] | what a module is made of: MCUs, docks, joints, rates, tasks of each MCU |
//! | [`router`]  | where a message goes next                                            |
//! | [`mailbox`], [`post_office`] | how it gets there on one MCU                         |
//! | [`motor`]   | how a joint is driven to its target                                  |
//! | [`docking`] | how a dock latches, and finds another                                |
//! | [`sensor`]  | the nineteen sensors, and what their readings mean                   |
//! | [`power`]   | what the docks carry, the battery, charging                          |
//! | [`devices`] | the task that serves all of these but the joints' control            |
//! | [`duty`]    | whether periodic tasks keep their periods                            |
//! | [`request`] | what behaviours ask of devices, and what devices tell                |
//! | [`counter`] | counts that one task keeps and others read                           |
//! | [`lfsr`]    | numbers by chance                                                    |
//! | [`api`]     | all that a behaviour sees                                            |

#![no_std]

pub mod api;
pub mod bridge;
pub mod counter;
pub mod device;
pub mod devices;
pub mod dock;
pub mod docking;
pub mod duty;
pub mod lfsr;
pub mod link;
pub mod mailbox;
pub mod message;
pub mod motor;
pub mod post_office;
pub mod power;
pub mod request;
pub mod router;
pub mod sensor;
pub mod superbot;
