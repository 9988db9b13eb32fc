//! The description of a run, in words and single numbers.

use std::collections::BTreeMap;

use hormone::data::Data;
use hormone::event::Event;
use hormone::gait::GaitName;
use hormone::module_type::ModuleType;
use serde::Serialize;
use simulation::{CLOCK_HZ, Face, LOST_AFTER, Recording, Wiring};
use tasks::dock::Dock;

use crate::pack::{ANGLE, POSITION, TURN};

/// The data that the recording itself does not have.
#[derive(Clone, Debug, Serialize)]
pub struct Subject {
    /// The robot's name.
    pub robot: String,
    /// The engine that ran it.
    pub engine: String,
    /// The length of the run, in s.
    pub seconds: f64,
    pub seed: u64,
    /// The ground that it moved on; `None` without a world.
    pub ground: Option<Ground>,
    /// The program's summary of the run.
    pub summary: String,
    /// The robot's faults, a line each.
    pub faults: Vec<String>,
}

/// The ground. The origin of positions is where the first module began; x points ahead, y to the left.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Ground {
    /// The slope, in degrees: positive if it rises ahead.
    pub slope: f64,
    pub stair: Option<Stair>,
    pub blocks: Vec<Block>,
}

/// Steps across the whole way, in m.
#[derive(Clone, Debug, Serialize)]
pub struct Stair {
    pub from: f64,
    pub height: f64,
    pub length: f64,
    pub number: usize,
}

/// A block on the ground.
#[derive(Clone, Debug, Serialize)]
pub struct Block {
    /// Its middle, in m.
    pub at: [f64; 2],
    /// Its edges, in m.
    pub size: [f64; 3],
    /// Its rotation to the left, in degrees.
    pub turn: f64,
}

/// The data that the page reads first.
#[derive(Serialize)]
pub struct About<'a> {
    #[serde(flatten)]
    subject: &'a Subject,
    modules: usize,
    /// The time between two samples, in s.
    every: f64,
    /// The units of the numbers in the bytes: mm, fractions of a unit quaternion's components, degrees.
    units: [f64; 3],
    /// The seconds after which a hormone that has not arrived counts as lost.
    lost_after: f64,
    docks: Vec<String>,
    letters: Vec<String>,
    types: Vec<String>,
    /// The events of behaviours, by code.
    codes: BTreeMap<u8, [String; 2]>,
    /// The gaits that an order can select, by number.
    gaits: BTreeMap<u8, String>,
}

/// The description of a part of a run, besides its bytes.
#[derive(Serialize)]
pub struct Part<'a> {
    looks: usize,
    wirings: Vec<Attached>,
    /// Seconds and words.
    happenings: Vec<(f64, &'a str)>,
    /// Whether lost frames were counted.
    counts_losses: bool,
}

/// The attachments from this time on.
#[derive(Serialize)]
struct Attached {
    seconds: f64,
    /// Pairs of modules and docks.
    pairs: Vec<[usize; 4]>,
}

impl<'a> About<'a> {
    /// The description of a robot of so many modules, which is sampled every `every` cycles.
    pub fn new(subject: &'a Subject, modules: usize, every: u64) -> Self {
        About {
            subject,
            modules,
            every: seconds(every),
            units: [POSITION, TURN, ANGLE],
            lost_after: seconds(LOST_AFTER),
            docks: Dock::ALL.iter().map(|dock| format!("{dock:?}")).collect(),
            letters: (0..).map_while(Data::from_byte).map(|data| format!("{data:?}")).collect(),
            types: (0..).map_while(ModuleType::from_byte).map(|it| format!("{it:?}")).collect(),
            codes: (0..=u8::MAX).filter_map(|code| Some((code, words(Event::from_byte(code)?)?))).collect(),
            gaits: (1..)
                .map_while(|code| Some((code, format!("{:?}", GaitName::from_byte(code)?))))
                .collect(),
        }
    }
}

impl<'a> Part<'a> {
    pub fn of(recording: &'a Recording) -> Self {
        Part {
            looks: recording.placings.len() / recording.modules.max(1),
            wirings: recording.wirings.iter().map(|(at, wiring)| attached(*at, wiring)).collect(),
            happenings: recording.happenings.iter().map(|(at, text)| (seconds(*at), text.as_str())).collect(),
            counts_losses: recording.losses.is_some(),
        }
    }
}

fn seconds(cycles: u64) -> f64 {
    cycles as f64 / f64::from(CLOCK_HZ)
}

fn attached(at: u64, wiring: &Wiring) -> Attached {
    let place = |Face { module, dock }: Face| [module, usize::from(dock.index())];
    let pair = |(one, other)| {
        let [[one, its], [other, others]] = [place(one), place(other)];
        [one, its, other, others]
    };
    Attached { seconds: seconds(at), pairs: wiring.attachments().map(pair).collect() }
}

/// The kind of an event, and its object; `None` for hormones between modules, which are recorded elsewhere.
fn words(event: Event) -> Option<[String; 2]> {
    let (what, of) = match event {
        Event::TopologyChanged(module_type) => ("type", format!("{module_type:?}")),
        Event::HormoneGenerated(data) => ("generated", format!("{data:?}")),
        Event::ActionBegun(action) => ("action", format!("{action:?}")),
        Event::MadeGood(data) => ("made good", format!("{data:?}")),
        Event::HormoneDropped(dock) => ("dropped", format!("{dock:?}")),
        Event::HormoneSent(..) | Event::HormoneReceived(..) => return None,
    };
    Some([what.into(), of])
}
