//! Calls and outcomes as bytes, in [postcard](https://docs.rs/postcard)'s format.

use kernel::{Priority, Refused, TaskState};
use serde::{Deserialize, Serialize};

use crate::call::{Call, Outcome};
use crate::world::Arrangement;

/// The longest command, in bytes.
pub const COMMAND_BYTES: usize = 8;

/// The longest reply, in bytes.
pub const REPLY_BYTES: usize = 5;

/// The size of an arrangement, in bytes.
pub const ARRANGEMENT_BYTES: usize = 18;

/// A command of the harness to a task, a handler, or the code that starts the tasks.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Command {
    /// There are no more calls. It is also the value of a mailbox without a command.
    Leave,
    /// Ask again, because an interrupt came instead of a call.
    Ask,
    Call(Call),
}

/// The reply of a task or a handler to the harness as it asks for the next command.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Reply {
    /// It has begun, or has only asked again.
    Nothing,
    Returned(Outcome),
}

/// The bytes of a value, and zeros behind them.
fn encode<const LENGTH: usize>(value: &impl Serialize) -> [u8; LENGTH] {
    let mut bytes = [0; LENGTH];
    if postcard::to_slice(value, &mut bytes).is_err() {
        panic!("a value on the wire is too long");
    }
    bytes
}

macro_rules! on_the_wire {
    ($value:ty, $bytes:ident) => {
        impl $value {
            /// The bytes of the value, and zeros behind them.
            #[inline(never)]
            pub fn to_bytes(&self) -> [u8; $bytes] {
                encode(self)
            }

            /// The value at the start of `bytes`; `None` if there is none.
            #[inline(never)]
            pub fn of_bytes(bytes: &[u8; $bytes]) -> Option<Self> {
                postcard::from_bytes(bytes).ok()
            }
        }
    };
}

on_the_wire!(Command, COMMAND_BYTES);
on_the_wire!(Reply, REPLY_BYTES);
on_the_wire!(Arrangement, ARRANGEMENT_BYTES);

// Mirrors of the kernel's own types, for `serde`.

#[derive(Serialize, Deserialize)]
#[serde(remote = "Priority")]
pub(crate) enum WirePriority {
    P0,
    P1,
    P2,
    P3,
    P4,
    P5,
    P6,
    P7,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Refused")]
pub(crate) enum WireRefused {
    NotStarted,
    Busy,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "TaskState")]
pub(crate) enum WireTaskState {
    NotStarted,
    Ready,
    Waiting,
    Suspended,
    Killed,
}
