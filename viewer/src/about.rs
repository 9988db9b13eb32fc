//! What is said of a run in words and single numbers.

use std::collections::BTreeMap;

use hormone::data::Data;
use hormone::event::Event;
use hormone::gait::GaitName;
use hormone::module_type::ModuleType;
use serde::Serialize;
use simulation::{CLOCK_HZ, Face, LOST_AFTER, Recording, Wiring};
use tasks::dock::Dock;

use crate::pack::{ANGLE, POSITION, TURN};

/// What the recording itself does not know.
#[derive(Clone, Debug, Serialize)]
pub struct Subject {
    /// What the robot is called.
    pub robot: String,
    /// What ran it.
    pub engine: String,
    /// How long, in s.
    pub seconds: f64,
    pub seed: u64,
    /// What it moved on; `None` where there was no world.
    pub ground: Option<Ground>,
    /// How it did, as the program says it.
    pub summary: String,
    /// What it did not do as it should, a line each.
    pub faults: Vec<String>,
}

/// The ground: places are said from where the first module began, x ahead, y to the left.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Ground {
    /// How steep it is, in degrees: positive where it rises ahead.
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

/// What stands on the ground.
#[derive(Clone, Debug, Serialize)]
pub struct Block {
    /// Its middle, in m.
    pub at: [f64; 2],
    /// Its edges, in m.
    pub size: [f64; 3],
    /// By how many degrees it is turned to the left.
    pub turn: f64,
}

/// What the page reads first.
#[derive(Serialize)]
pub struct About<'a> {
    #[serde(flatten)]
    subject: &'a Subject,
    modules: usize,
    /// The time between two looks, in s.
    every: f64,
    /// What the units of the bytes are: mm, of a whole turn's quaternion, degrees.
    units: [f64; 3],
    /// After so many seconds on its way a hormone is lost.
    lost_after: f64,
    docks: Vec<String>,
    letters: Vec<String>,
    types: Vec<String>,
    /// By code, what a behaviour did.
    codes: BTreeMap<u8, [String; 2]>,
    /// By number, the gaits that the robot can be ordered to walk by.
    gaits: BTreeMap<u8, String>,
}

/// What is said of a part of a run, beside its bytes.
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
    /// Of a robot of so many modules, at which somebody looks once in so many cycles.
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

/// What it is, and of what; `None` for hormones between modules, which are kept otherwise.
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
