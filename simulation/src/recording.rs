//! The recording of a run, to be looked at later: where modules were, what behaviours did, what passed
//! between modules, and what happened to the robot.

mod recorder;

use hormone::data::Data;
use hormone::module_type::ModuleType;
use tasks::dock::DockSet;

use crate::placing::Placing;
use crate::trace_event::TraceEvent;
use crate::wiring::{Face, Wiring};

pub use recorder::Recorder;

/// A run that is over, or a part of one.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The time between two looks, in cycles. The first is at power-up.
    pub every: u64,
    /// How many modules the robot has.
    pub modules: usize,
    /// By look, and within each look by module.
    pub placings: Vec<Placing>,
    /// The events of behaviours, except that they sent hormones or took them up, in order.
    pub trace_events: Vec<TraceEvent>,
    /// Hormones on their ways between modules, in the order in which they were sent.
    pub hormones: Vec<Passage>,
    /// Changes of what modules know of their neighbours and themselves, in order.
    pub views: Vec<View>,
    /// Frames that links have lost, in order. `None` if they are not counted.
    pub losses: Option<Vec<Loss>>,
    /// The attachments at power-up, and after each change, in order.
    pub wirings: Vec<(u64, Wiring)>,
    /// The events that happened to the robot, in words, and when, in cycles.
    pub happenings: Vec<(u64, String)>,
}

impl Recording {
    /// An empty recording of a robot of so many modules, which is looked at once in so many cycles.
    pub(crate) fn new(modules: usize, every: u64) -> Self {
        Recording {
            every,
            modules,
            placings: Vec::new(),
            trace_events: Vec::new(),
            hormones: Vec::new(),
            views: Vec::new(),
            losses: None,
            wirings: Vec::new(),
            happenings: Vec::new(),
        }
    }

    /// Whether nothing is in it.
    pub fn is_empty(&self) -> bool {
        let Recording { placings, trace_events, hormones, wirings, happenings, .. } = self;
        [placings.len(), trace_events.len(), hormones.len(), wirings.len(), happenings.len()] == [0; 5]
    }
}

/// A hormone on its way between two modules.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// The dock that it left by.
    pub from: Face,
    pub data: Data,
    /// When it was handed to the link there, in cycles.
    pub sent: u64,
    /// When the neighbour had it, in cycles; `None` if it did not come.
    pub arrived: Option<u64>,
}

/// A module's knowledge of its neighbours and itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct View {
    /// The number of the look at which that was seen.
    pub look: usize,
    pub module: usize,
    /// The docks at which it has found a neighbour.
    pub docks: DockSet,
    /// The type that it takes itself for; `None` while it has not begun, or has no power.
    pub module_type: Option<ModuleType>,
}

/// Frames that a link has lost between two looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loss {
    /// The number of the later look.
    pub look: usize,
    /// Where the link begins.
    pub from: Face,
    pub frames: u64,
}
