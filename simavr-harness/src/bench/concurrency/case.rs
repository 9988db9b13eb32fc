//! The cases in which both programs are compared.

use std::path::Path;

use serde::Serialize;
use simulation::{Face, Random};
use tasks::dock::Dock;
use tasks::superbot::MASTER_AXES;

use super::watch::{Periodic, Watch};
use super::{Style, chain};
use crate::Controller;
use crate::bench::module::control::{Control, TURN};
use crate::bench::module::{MEASURED, MILLISECOND, ModuleImages, SECOND, awake, babble, module, saturated};
use crate::bench::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::image::Place;
use crate::part::Pin;

/// A case. In all cases a load pulls at the joints, so that they are controlled; two behaviours have work
/// every 7 ms and every 11 ms; and one behaviour answers an edge that comes once in 80 ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Case {
    /// There is no other load.
    Control,
    /// Neighbours at all docks send as fast as they can.
    Saturated,
    /// Neighbours at four docks send as fast as they can, and hormones pass by the other two docks.
    Crowded,
    /// Garbage comes in at all docks, at the full rate.
    Babble,
    /// A behaviour computes for 50 ms, every 200 ms.
    Computes,
    /// The same computation, cut by hand into pieces of 0.1 ms, between which the loop serves all the rest.
    ComputesInPieces,
    /// A behaviour computes for up to 80 ms, a time that is not known beforehand.
    ComputesUnknown,
    /// A behaviour computes and never ends.
    Hangs,
}

impl Case {
    pub const ALL: [Case; 8] = [
        Case::Control,
        Case::Saturated,
        Case::Crowded,
        Case::Babble,
        Case::Computes,
        Case::ComputesInPieces,
        Case::ComputesUnknown,
        Case::Hangs,
    ];

    /// Whether the case applies to a style: tasks need not be cut into pieces.
    pub fn is_of(self, style: Style) -> bool {
        style == Style::Loop || self != Case::ComputesInPieces
    }

    /// The length of the behaviour's next computation, in pieces of 0.1 ms.
    fn length(self, random: &mut Random) -> u16 {
        match self {
            Case::Control | Case::Saturated | Case::Crowded | Case::Babble => 0,
            Case::Computes | Case::ComputesInPieces => 500,
            Case::ComputesUnknown => random.below(801) as u16,
            Case::Hangs => trial::ENDLESS,
        }
    }

    /// Whether hormones pass through the module.
    fn has_hormones(self) -> bool {
        !matches!(self, Case::Saturated | Case::Babble)
    }
}

/// The results of a case, on the master. Times are in us or ms, as the names of the fields say.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub case: Case,
    pub style: Style,
    /// Periods of the joints' control that did not begin, because the one before was not done, the MCU was
    /// reset, or a joint was given up; and the number of all periods.
    pub control_missed: u64,
    pub control_periods: u64,
    /// Whether periods had stopped beginning by the end of the case.
    pub control_given_up: bool,
    /// From the earliest to the latest begin within a period; `None` if the MCU was reset.
    pub control_jitter_us: Option<f64>,
    /// The longest time from the begin of a period until the drives were computed.
    pub control_done_us_max: f64,
    /// The farthest that the load turned a joint of the master, which was to be kept at 0 degrees.
    pub joint_strays_deg_max: f64,
    /// Bytes and frames that came and were lost for want of space, `None` if the MCU was reset or they were
    /// more than a link counts; and frames that the head and the tail had to repeat.
    pub bytes_lost: Option<u64>,
    pub frames_repeated: u64,
    /// Hormones that did not arrive, and the time from the HORMONE of one module to that of the next.
    pub hormones_lost: Option<u64>,
    pub hop_us_mean: Option<f64>,
    pub hop_us_max: Option<f64>,
    /// The time from an edge to its answer; and edges that were not answered before the next one.
    pub reaction_us_mean: Option<f64>,
    pub reaction_us_max: Option<f64>,
    pub edges_unanswered: u64,
    /// How the behaviours with a period kept it.
    pub seven: Periodic,
    pub eleven: Periodic,
    /// The share of time in which the CPU is awake.
    pub cpu_percent: f64,
    /// The number of resets by the watchdog.
    pub resets: u64,
}

/// The pin whose edges a behaviour answers.
const EDGE: Pin = Pin { port: 'E', bit: 4 };

/// The time for which the pin stays high, in cycles.
const HIGH: u64 = MILLISECOND;

/// The fraction of zeros in the babble. Each of them ends what may be a frame.
const ZEROS: f64 = 1.0 / 16.0;

/// Runs a case for `seconds` seconds, on the images in `directory`.
///
/// # Errors
/// An image is missing, or does not do what is to be measured.
pub fn run(directory: &Path, case: Case, style: Style, seconds: u64) -> Result<Row, BenchError> {
    let images =
        ModuleImages { directory: directory.to_owned(), master: Some(directory.join(style.trial())) };
    let robot = match case {
        Case::Saturated => saturated::robot(&images, "flood_side")?,
        Case::Crowded => saturated::at_sides(chain(&images, 3 + 4)?, &images, "flood_side")?,
        _ => chain(&images, 3)?,
    };
    let mut engine = Engine::new(robot.build()?, 1);
    engine.run_until(2 * SECOND);
    let neighbours = [Face { module: 1, dock: Dock::Back }, Face { module: 2, dock: Dock::Front }];
    if case == Case::Babble {
        babble::drown(&mut engine, neighbours, 1.0)?;
    }
    let mut random = Random::new(1);
    if case == Case::ComputesInPieces {
        set(&mut engine, "TRIAL_IS_CUT", &[1])?;
    }
    let mut control = Control::watch(&mut engine);
    let mut watch = Watch::begin(&mut engine);
    let [before, _] = awake(&engine)?;
    let mut strays: f64 = 0.0;
    for _ in 0..seconds * SECOND / TURN {
        set(&mut engine, "TRIAL_LENGTH", &case.length(&mut random).to_le_bytes())?;
        if case == Case::Babble {
            babble::babble(&mut engine, &mut random, ZEROS);
        }
        let quiet = random.below(TURN as usize / 2) as u64;
        control.turn_by(&mut engine, |engine, end| {
            engine.run_until(engine.cycle() + quiet);
            watch.edge(drive(engine, true));
            engine.run_until(engine.cycle() + HIGH);
            drive(engine, false);
            while engine.cycle() < end {
                engine.run_until(end.min(engine.cycle() + 5 * MILLISECOND));
                strays = strays.max(strayed(engine));
            }
        });
        watch.look(&mut engine);
    }
    let [after, _] = awake(&engine)?;
    let resets = module(&engine)?.mcu(Controller::Master).resets();
    let rhythm =
        control.of_master().ok_or_else(|| unmeasurable(style.trial(), "its joints are not controlled"))?;
    let micro = |cycles: f64| cycles * 1e6 / SECOND as f64;
    let hop = watch.hops.latency().filter(|_| case.has_hormones());
    let reaction = watch.reaction();
    Ok(Row {
        case,
        style,
        control_missed: rhythm.missed,
        control_periods: control.periods(),
        control_given_up: engine.cycle() - control.last() > 2 * TURN,
        control_jitter_us: (resets == 0).then(|| micro(rhythm.jitter as f64)),
        control_done_us_max: micro(control.longest() as f64),
        joint_strays_deg_max: strays,
        bytes_lost: watch.bytes_lost().filter(|_| resets == 0),
        frames_repeated: watch.frames_repeated,
        hormones_lost: case.has_hormones().then(|| watch.hops.lost()),
        hop_us_mean: hop.map(|(mean, _)| micro(mean)),
        hop_us_max: hop.map(|(_, max)| micro(max as f64)),
        reaction_us_mean: reaction.map(|(mean, _)| micro(mean)),
        reaction_us_max: reaction.map(|(_, max)| micro(max as f64)),
        edges_unanswered: watch.unanswered,
        seven: watch.periodic(trial::mark::SEVEN, trial::SEVEN, engine.cycle()),
        eleven: watch.periodic(trial::mark::ELEVEN, trial::ELEVEN, engine.cycle()),
        cpu_percent: 100.0 * (after - before) as f64 / (engine.cycle() - watch.start) as f64,
        resets,
    })
}

/// The largest distance of a joint of the master from 0 degrees.
fn strayed(engine: &Engine) -> f64 {
    let Some(module) = engine.robot().module(MEASURED) else { return 0.0 };
    MASTER_AXES.into_iter().map(|axis| module.body().joint(axis).degrees().abs()).fold(0.0, f64::max)
}

/// Drives the pin of the edge. Returns the cycle of the master.
fn drive(engine: &mut Engine, level: bool) -> u64 {
    engine.robot_mut().module_mut(MEASURED).map_or(0, |module| {
        let master = module.mcu_mut(Controller::Master);
        master.drive_pin(EDGE, level);
        master.cycle()
    })
}

/// Sets a variable of the measured master.
fn set(engine: &mut Engine, name: &str, bytes: &[u8]) -> Result<(), BenchError> {
    let module = engine.robot_mut().module_mut(MEASURED);
    let master = module.ok_or_else(|| unmeasurable("robot", "it has no module"))?.mcu_mut(Controller::Master);
    let place = master.image().symbol(name).map(|symbol| symbol.place);
    let Some(Place::Data(start)) = place else {
        return Err(unmeasurable(
            "trial",
            format!("the image has no {name}: build it with ./x bench concurrency"),
        ));
    };
    for (address, byte) in (start..).zip(bytes) {
        master.write(address, *byte);
    }
    Ok(())
}
