//! The three behaviours (paper, Figure 5) as kernel tasks: drivers of the
//! [state machines](crate::behaviours) with a stack, a queue and a priority each.
//!
//! They see the module through [`tasks::api`] alone, run below all system tasks, and are the same in every
//! module. AC_RECV stands above AC_SEND. HORMONE, whose rules are what people change, stands below both:
//! while it computes, neighbours are heard and probed. The lowest of the three feeds the watchdog, so a
//! behaviour that hangs in a loop resets the module.

pub mod ac_receive;
pub mod ac_send;
pub mod hormone;

use kernel::{Mutex, Task};
use tasks::api::Api;
use tasks::message::Message;
use tasks::post_office::Undelivered;

use crate::behaviours::AdaptiveCommunication;
use crate::event::Event;
use crate::module::Module;

/// The module, for the task that runs.
pub struct Here<'a> {
    pub task: &'a mut Task,
    pub api: Api,
}

impl Module for Here<'_> {
    #[inline(never)] // called in many places: saves flash
    fn send(&mut self, message: Message) -> Result<(), Undelivered> {
        self.api.send(self.task, message)
    }

    #[inline(never)] // for `stack-bound`, which is told what the function pointer calls
    fn trace(&mut self, event: Event) {
        self.api.trace(event.to_byte());
    }
}

/// What AC_SEND and AC_RECV share. Its ceiling is the priority of AC_RECV, the highest that works on it.
pub type Shared = Mutex<AdaptiveCommunication>;
