//! Keeps what a robot does as it runs.

use std::collections::HashMap;

use hormone::event::Event;
use hormone::module_type::ModuleType;
use hormone::neighbours::Neighbours;
use tasks::dock::{Dock, DockSet};

use super::{Loss, Passage, Recording, View};
use crate::change::Change;
use crate::hops::{Arrival, LOST_AFTER};
use crate::robot::Robot;
use crate::scenario;
use crate::trace_event::TraceEvent;
use crate::wiring::{Face, Wiring};

/// Keeps a robot's run. It changes neither the run nor what observers see.
pub struct Recorder {
    recording: Recording,
    /// How often it has looked.
    looks: usize,
    /// The hormones under way: their places in the recording.
    under_way: HashMap<(Face, u64), usize>,
    /// By module, what it knew of its neighbours and itself at the last look.
    known: Vec<(DockSet, Option<ModuleType>)>,
    /// How it was wired after the last change.
    wiring: Wiring,
    /// The frames that each link had lost at the last look.
    lost: HashMap<Face, u64>,
    /// How a robot without a world lies, in degrees.
    roll: f64,
}

impl Recorder {
    /// Begins with a robot at power-up, at which it is to look once in so many cycles.
    pub fn new(robot: &impl Robot, every: u64) -> Self {
        let modules = robot.wiring().modules();
        let mut recording = Recording::new(modules, every.max(1));
        recording.wirings.push((0, robot.wiring().clone()));
        let known = vec![(DockSet::EMPTY, None); modules];
        Recorder {
            recording,
            looks: 0,
            under_way: HashMap::new(),
            known,
            wiring: robot.wiring().clone(),
            lost: HashMap::new(),
            roll: 0.0,
        }
    }

    /// When it is to look next, in cycles.
    pub fn next_look(&self) -> u64 {
        self.looks as u64 * self.recording.every
    }

    /// Looks at the robot, at the time of [`next_look`](Self::next_look).
    pub fn look(&mut self, robot: &impl Robot) {
        let look = self.looks;
        self.looks += 1;
        self.look_for_losses(robot, look);
        self.look_for_views(robot, look);
        let modules = robot.wiring().modules();
        let in_world: Option<Vec<_>> = (0..modules).map(|module| robot.placing(module)).collect();
        let placings = in_world.unwrap_or_else(|| {
            let roll = glam::DAffine3::from_rotation_x(self.roll.to_radians());
            robot.wiring().placings_bent(roll, |module| robot.angles(module))
        });
        self.recording.placings.extend(placings);
    }

    fn look_for_losses(&mut self, robot: &impl Robot, look: usize) {
        for from in robot.wiring().faces() {
            let Some(lost) = robot.lost_frames(from) else { continue };
            let losses = self.recording.losses.get_or_insert_default();
            let before = self.lost.insert(from, lost).unwrap_or(0);
            // Fewer than before: it was attached anew.
            let frames = lost.checked_sub(before).unwrap_or(lost);
            if frames > 0 {
                losses.push(Loss { look, from, frames });
            }
        }
    }

    fn look_for_views(&mut self, robot: &impl Robot, look: usize) {
        for (module, known) in self.known.iter_mut().enumerate() {
            let status = robot.status(module).filter(|_| robot.is_on(module));
            let docks = docks(status.and_then(|status| status.neighbours()));
            let module_type = status.map(|status| status.module_type);
            if std::mem::replace(known, (docks, module_type)) != (docks, module_type) {
                self.recording.views.push(View { look, module, docks, module_type });
            }
        }
    }

    /// Takes in an event of a behaviour, and the hormone that came by it, if one did.
    pub fn take(&mut self, trace_event: &TraceEvent, arrival: Option<Arrival>) {
        let &TraceEvent { cycle, module, event } = trace_event;
        match event {
            Event::HormoneSent(dock, data) => {
                let from = Face { module, dock };
                self.under_way.insert((from, cycle), self.recording.hormones.len());
                self.recording.hormones.push(Passage { from, data, sent: cycle, arrived: None });
            }
            Event::HormoneReceived(..) => {}
            _ => self.recording.trace_events.push(*trace_event),
        }
        if let Some(Arrival { from, sent }) = arrival
            && let Some(index) = self.under_way.remove(&(from, sent))
        {
            self.recording.hormones[index].arrived = Some(cycle);
        }
    }

    /// Something has happened to the robot, which is wired so now.
    pub fn changed(&mut self, event: &scenario::Event, wiring: &Wiring) {
        if let Change::Roll(degrees) = event.change {
            self.roll = degrees;
        }
        if self.wiring != *wiring {
            // A link that is attached anew counts from 0. One that the robot itself attached may have been
            // looked at since.
            if event.at + self.recording.every >= self.next_look() {
                self.lost.retain(|&from, _| wiring.peer(from) == self.wiring.peer(from));
            }
            self.wiring = wiring.clone();
            self.recording.wirings.push((event.at, wiring.clone()));
        }
        self.recording.happenings.push((event.at, event.change.to_string()));
    }

    /// Hands over what it has kept since the last call, up to `now`. Hormones come once they have arrived or
    /// are lost, so those of one call may have been sent before those of the last one.
    pub fn news(&mut self, now: u64) -> Recording {
        let mut rest = Recording::new(self.recording.modules, self.recording.every);
        rest.losses = self.recording.losses.as_ref().map(|_| Vec::new());
        let mut news = std::mem::replace(&mut self.recording, rest);
        let is_settled = |passage: &Passage| passage.arrived.is_some() || passage.sent + LOST_AFTER < now;
        (news.hormones, self.recording.hormones) = news.hormones.into_iter().partition(is_settled);
        let left = self.recording.hormones.iter().enumerate();
        self.under_way = left.map(|(index, passage)| ((passage.from, passage.sent), index)).collect();
        news
    }

    /// The recording.
    pub fn finish(self) -> Recording {
        self.recording
    }
}

fn docks(neighbours: Option<Neighbours>) -> DockSet {
    let mut docks = DockSet::EMPTY;
    let neighbours = neighbours.into_iter().flatten();
    let found = Dock::ALL.into_iter().zip(neighbours).filter(|(_, neighbour)| neighbour.is_some());
    found.for_each(|(dock, _)| docks.insert(dock));
    docks
}
