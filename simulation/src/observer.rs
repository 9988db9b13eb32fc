//! All observers of a robot at once.

use std::mem::replace;

use hormone::gait::GaitName;
use tasks::router::Mcu;

use crate::change::{Change, Links};
use crate::command::SENDS;
use crate::course::Course;
use crate::discovery::Discovery;
use crate::gait::Gait;
use crate::hardware::{CHARACTER, FRAME_OVERHEAD, GIVEN_UP_AFTER, START_UP, is_on_slave, tries};
use crate::hops::Hops;
use crate::recording::Recorder;
use crate::robot::Robot;
use crate::scenario::Event;
use crate::trace_event::TraceEvent;
use crate::wiring::{Face, Wiring};

/// Follows a robot as it runs.
pub struct Observer {
    pub hops: Hops,
    pub discovery: Discovery,
    pub gait: Gait,
    /// The robot's own changes of its wiring, in order.
    pub own_changes: Vec<Event>,
    /// How many of them came before anything from outside that may have modules dock or let go. `None` until
    /// that has come.
    unasked: Option<usize>,
    /// The orders that came while no program ran that would have heard them.
    pub unheard: Vec<Event>,
    /// The attachments that modules can find out: none where one end is blind.
    pub audible: Wiring,
    /// The recorder that keeps the run, if there is one.
    pub recorder: Option<Recorder>,
    /// The events that have happened to it from outside.
    pub(crate) course: Course,
    disturbances: Vec<Disturbance>,
    wiring: Wiring,
    /// Docks from which nothing comes through, whatever is attached there, and whether noise is why.
    muted: Vec<(Face, bool)>,
    /// How the robot lies turned about its long axis, in degrees.
    roll: f64,
    /// By module, since when the programs of its master and its slave hear, and (`start`) how long they take
    /// until then from the end of a reset.
    hear_since: Vec<[u64; 2]>,
    start: u64,
}

/// A disturbance of lines, which lose frames or change bytes.
struct Disturbance {
    is_noise: bool,
    links: Links,
    probability: f64,
}

impl Disturbance {
    fn of(change: &Change) -> Option<Self> {
        match *change {
            Change::Loss { links, probability } => Some(Disturbance { is_noise: false, links, probability }),
            Change::Noise { links, probability } => Some(Disturbance { is_noise: true, links, probability }),
            _ => None,
        }
    }

    fn replaces(&self, before: &Self) -> bool {
        self.is_noise == before.is_noise && (self.links == Links::All || self.links == before.links)
    }
}

impl Observer {
    /// A robot at power-up. `period` is that of its gait, in cycles.
    pub fn new(robot: &impl Robot, period: u64) -> Self {
        let wiring = robot.wiring();
        Observer {
            hops: Hops::new(wiring.modules()),
            discovery: Discovery::new(robot),
            gait: Gait::new(wiring, period),
            own_changes: Vec::new(),
            unasked: None,
            unheard: Vec::new(),
            audible: wiring.clone(),
            recorder: None,
            course: Course::NEW,
            disturbances: Vec::new(),
            wiring: wiring.clone(),
            muted: Vec::new(),
            roll: 0.0,
            hear_since: (0..wiring.modules())
                .map(|module| [robot.powered_up_at(module) + robot.start(); 2])
                .collect(),
            start: robot.start(),
        }
    }

    /// Looks at what the robot has done since the last call, and how it is.
    pub fn look(&mut self, robot: &mut impl Robot) {
        self.hear(robot);
        self.reshape(robot.now());
        let concerned = self.gait.listen(robot);
        self.hops.disturbed(&concerned, robot.now());
        self.discovery.look(robot);
        self.gait.pass(robot.now());
        self.gait.feel(robot);
        self.gait.look_for_rest(robot);
    }

    /// Takes in what the robot has done since the last call.
    pub fn hear(&mut self, robot: &mut impl Robot) {
        let mut trace_events = robot.take_trace_events().into_iter().peekable();
        for event in robot.take_changes() {
            while let Some(trace_event) = trace_events.next_if(|trace_event| trace_event.cycle < event.at) {
                self.take(&trace_event);
            }
            self.follow(&event);
            self.own_changes.push(event);
        }
        trace_events.for_each(|trace_event| self.take(&trace_event));
    }

    fn reshape(&mut self, now: u64) {
        let concerned = self.gait.reshaped(now);
        self.hops.disturbed(&concerned, now);
    }

    fn take(&mut self, trace_event: &TraceEvent) {
        self.reshape(trace_event.cycle);
        let arrival = self.hops.take(trace_event, &self.wiring);
        if let Some(recorder) = &mut self.recorder {
            recorder.take(trace_event, arrival);
        }
        self.discovery.take(trace_event);
        self.gait.take(trace_event);
    }

    /// The robot's own changes that nothing had asked for.
    pub fn unasked(&self) -> &[Event] {
        &self.own_changes[..self.unasked.unwrap_or(self.own_changes.len())]
    }

    /// Takes in an event that has just happened to the robot.
    pub fn changed(&mut self, event: &Event) {
        self.follow(event);
        if may_dock(&event.change) {
            self.unasked.get_or_insert(self.own_changes.len());
        }
        let order = event.change.orders();
        if order.is_some() && !self.is_heard(event) {
            self.unheard.push(event.clone());
            return;
        }
        self.course.take(event);
        if let Some((module, gait, period)) = order {
            let concerned = self.gait.ordered(module, gait, period, event.at);
            self.hops.disturbed(&concerned, event.at);
            if matches!(event.change, Change::Command { at, .. } if self.gait.may_miss(at, event.at)) {
                self.gait.interrupted(module, event.at);
            }
        }
    }

    /// Whether the programs that have to hear a command hear it. The slave passes on the first sending that
    /// it hears, and no other, and gives it up if the master does not run soon.
    fn is_heard(&self, event: &Event) -> bool {
        let &Change::Command { at: Face { module, dock }, ref payload } = &event.change else { return true };
        let frame = (FRAME_OVERHEAD + payload.len() as u64) * CHARACTER;
        let [master, slave] = self.hear_since[module];
        let sent = SENDS.iter().map(|later| event.at + later);
        if !is_on_slave(dock) {
            return sent.max().is_some_and(|at| at >= master);
        }
        sent.filter(|at| *at >= slave).min().is_some_and(|at| at + frame + GIVEN_UP_AFTER >= master)
    }

    fn follow(&mut self, event: &Event) {
        let &Event { at, ref change } = event;
        self.reshape(at);
        let before = matches!(change, Change::Swap(..)).then(|| self.wiring.clone());
        // A change that the robot made itself was possible.
        let _ = change.apply(&mut self.wiring);
        if let Some(recorder) = &mut self.recorder {
            recorder.changed(event, &self.wiring);
        }
        self.gait.pass(at);
        if let Change::Roll(degrees) = *change
            && replace(&mut self.roll, degrees) != degrees
        {
            self.gait.turned(at);
        }
        if let Some(disturbance) = Disturbance::of(change) {
            self.mute(&disturbance);
            let is_everywhere = disturbance.links == Links::All;
            self.disturbances.retain(|before| !disturbance.replaces(before));
            self.disturbances.extend((disturbance.probability > 0.0).then_some(disturbance));
            if is_everywhere {
                self.gait.loses(tries(self.everywhere(false), self.everywhere(true)), at);
            }
            let are_noisy = !self.disturbances.is_empty();
            self.gait.disturb_lines(are_noisy, at);
            self.hops.disturb_lines(are_noisy, at);
        }
        let audible = self.audible();
        if let Change::Reset { module, .. } = *change {
            self.gait.interrupted(module, at);
        }
        let touched = match *change {
            Change::Reset { module, .. } => audible.peers(module).chain([module]).collect(),
            // A module that comes to a dock that is blind in one direction says for a moment that it hears
            // its neighbour of before.
            _ => before.map_or_else(Vec::new, |before| before.differences(&self.wiring)),
        };
        if !touched.is_empty() || audible != self.audible {
            self.discovery.rewired(&audible, at);
            let concerned = self.gait.disturbed(&audible, &touched, at);
            self.hops.disturbed(&concerned, at);
            self.audible = audible;
        }
        if let Change::Reset { module, mcus } = *change {
            for (mcu, since) in Mcu::ALL.into_iter().zip(&mut self.hear_since[module]) {
                if mcus.contains(mcu) {
                    *since = (at + START_UP + self.start).max(*since);
                }
            }
            if mcus.contains(Mcu::Master) {
                self.discovery.restarted(module, at);
                self.gait.restarted(module, self.hear_since[module][0]);
            }
        }
    }

    /// The chance that all links lose a frame, or that noise changes a byte on them.
    fn everywhere(&self, is_noise: bool) -> f64 {
        let is_meant = |it: &&Disturbance| it.is_noise == is_noise && it.links == Links::All;
        self.disturbances.iter().find(is_meant).map_or(0.0, |disturbance| disturbance.probability)
    }

    fn mute(&mut self, &Disturbance { is_noise, links, probability }: &Disturbance) {
        let is_meant = |face: &Face| links == Links::All || links == Links::From(*face);
        self.muted.retain(|(face, by_noise)| *by_noise != is_noise || !is_meant(face));
        if probability >= 1.0 {
            let faces = self.wiring.docks().filter(is_meant);
            self.muted.extend(faces.map(|face| (face, is_noise)));
        }
    }

    /// The wiring without the attachments that are blind in one direction: neither end counts the other then.
    fn audible(&self) -> Wiring {
        let mut audible = self.wiring.clone().without_obstacles();
        for &(face, _) in &self.muted {
            // Where nothing is attached nothing is to be detached.
            let _ = audible.detach(face);
        }
        audible
    }
}

/// Whether modules that hear this may dock or let go: an order to take another shape, or what is no order.
fn may_dock(change: &Change) -> bool {
    match change.orders() {
        Some((_, gait, _)) => GaitName::from_byte(gait).is_some_and(|name| name.gait().once.is_some()),
        None => matches!(change, Change::Command { .. }),
    }
}
