//! Receptor rules: one row of Table 1 each, as data.

use tasks::dock::DockSet;

use crate::action::Action;
use crate::hormone::Hormone;
use crate::local_timer::Phase;
use crate::module_type::ModuleType;

/// What a rule answers to.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Trigger {
    /// The local timer comes by this phase of the Period.
    Timer(Phase),
    /// This hormone is received.
    Received(Hormone),
}

/// A hormone to send, and through which docks: the paper's `[CP, A, {l,r,b}]`.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Outgoing {
    /// What to send.
    pub hormone: Hormone,
    /// The docks it leaves by.
    pub docks: DockSet,
}

/// What a module of one type does at one trigger. Seven bytes of program memory.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Rule {
    /// The type of module it holds for.
    pub module_type: ModuleType,
    /// What it answers to.
    pub trigger: Trigger,
    /// The action to perform.
    pub action: Action,
    /// The hormone to send. It leaves by the docks named here that have a neighbour, be it the dock
    /// the trigger came in by.
    pub send: Option<Outgoing>,
}

impl Rule {
    /// A row of a rule table, in the order of Table 1's columns.
    pub const fn new(
        module_type: ModuleType,
        trigger: Trigger,
        action: Action,
        send: Option<Outgoing>,
    ) -> Rule {
        Rule { module_type, trigger, action, send }
    }
}

const _: () = assert!(size_of::<Rule>() == 7);
