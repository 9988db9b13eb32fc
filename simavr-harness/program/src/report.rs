//! The report of a run.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Serialize;
use simavr_harness::Controller;
use simulation::{
    BridgeTotals, CLOCK_HZ, Change, Event, Face, LinkTotals, MILLISECOND, Moment, Observer, Robot, Run,
    Transcript, Trouble,
};

use super::arguments::{CoreName, EngineName, Sim, WorldName};
use super::cost::{Cost, Used};

/// A robot that has come less far than this, in m, stands. Figures relative to its way would be random.
const STANDS_M: f64 = 0.001;

/// The summary. Fields are only ever added: people's CI reads them.
#[derive(Serialize)]
pub struct Report {
    pub engine: EngineName,
    /// The interpreter that executed the images, if there were any.
    pub core: Option<CoreName>,
    pub modules: usize,
    /// The number of simulated MCUs.
    pub mcus: usize,
    pub simulated_seconds: f64,
    pub wall_seconds: f64,
    /// Wall time over simulated time.
    pub wall_ratio: f64,
    pub cost: Cost,
    pub seed: u64,
    /// The variations from module to module: the most percent, by assumption.
    pub varied_percent: BTreeMap<&'static str, f64>,
    /// Probability that a frame is lost, each way.
    pub loss: f64,
    /// The number of modules by the type that they have found for themselves.
    pub types: BTreeMap<String, usize>,
    /// Whether every module's own view of its neighbours and its type equals the wiring.
    pub topology_correct: bool,
    /// Hormones handed to links, one for each dock that a hormone left by.
    pub hormones_sent: u64,
    /// The sent hormones that the neighbour took up.
    pub hormones_delivered: u64,
    /// The sent hormones that arrived and were no news.
    pub hormones_dropped: u64,
    pub hormones_lost: u64,
    /// Hormones that a module took up with the same data as the one before.
    pub hormones_out_of_turn: u64,
    pub hop_latency_us: Option<Latency>,
    /// The mean hop latency over the mean of the limits set by the wires.
    pub hop_over_wire: Option<f64>,
    /// The longest time that a module took to find a neighbour.
    pub discovery_ms_max: Option<f64>,
    /// The longest time that a module took to notice that a neighbour was gone.
    pub loss_notice_ms_max: Option<f64>,
    /// How often modules gave up or found again a neighbour that was attached all the time.
    pub topology_lapses: u64,
    /// The changes that the robot itself has made to its wiring.
    pub reconfigurations: Vec<Reconfiguration>,
    pub legs: usize,
    /// Wrong actions of modules outside of the time that they have to recover.
    pub gait_violations: u64,
    /// The longest time between the starts of the legs of a branch.
    pub leg_skew_us_max: Option<f64>,
    /// The longest time that a module took from power-up, or from a change of the robot, until it acted
    /// correctly, in Periods.
    pub recovery_periods_max: Option<f64>,
    /// The kind of world that the robot is in.
    pub world: WorldName,
    /// The distance that it has come ahead, in m.
    pub distance_m: Option<f64>,
    /// The distance ahead, relative to the robot's length at power-up.
    pub body_lengths: Option<f64>,
    /// The distance to a side, relative to the distance ahead.
    pub sideways_percent: Option<f64>,
    /// The angle by which it has turned to the left, in degrees.
    pub heading_degrees: Option<f64>,
    /// The speed at which the parts that bear it slide on the ground, relative to its own speed.
    pub slip_percent: Option<f64>,
    /// The most that a module with two legs leaned from how the robot was laid down.
    pub tilt_degrees_max: Option<f64>,
    /// The charge that the module with the highest consumption has taken from its battery, of a full charge.
    pub charge_percent_max: Option<f64>,
    /// The distance that the robot would come until that battery is empty.
    pub metres_per_charge: Option<f64>,
    /// Why the world could not go on.
    pub trouble: Option<Broken>,
    /// `None` where no MCU is simulated.
    pub cpu_load: Option<CpuLoad>,
    pub link: LinkTotals,
    pub bridge: BridgeTotals,
    pub consoles: Vec<Console>,
    /// A hash over the RAM, registers and clocks of all MCUs and over the world, in hexadecimal.
    pub state_hash: String,
    /// The faults of the robot, a line each.
    faults: Vec<String>,
}

/// An attachment that the robot has made or undone by itself, written as in a robot file.
#[derive(Serialize)]
pub struct Reconfiguration {
    /// In seconds since power-up.
    pub at: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attach: Option<[String; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detach: Option<String>,
}

/// The way in which a world broke.
#[derive(Serialize)]
pub struct Broken {
    pub seconds: f64,
    pub place: String,
    pub what: String,
    /// The last moments of the joint before that.
    pub last: Vec<Last>,
}

/// A joint at one moment.
#[derive(Serialize)]
pub struct Last {
    pub seconds: f64,
    pub degrees: Option<f64>,
    pub degrees_per_second: Option<f64>,
    pub volts: f64,
}

impl Broken {
    fn of(trouble: &Trouble) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        let last = |&Moment { seconds, degrees, degrees_per_second, volts }: &Moment| Last {
            seconds,
            degrees: finite(degrees),
            degrees_per_second: finite(degrees_per_second),
            volts,
        };
        let Trouble { seconds, place, what, .. } = trouble.clone();
        Broken { seconds, place, what, last: trouble.last.iter().map(last).collect() }
    }
}

/// The text that a console has sent.
#[derive(Serialize)]
pub struct Console {
    /// The time at which it was asked, in seconds since power-up, and the dock.
    pub at: f64,
    pub dock: String,
    /// Whether the text is complete.
    pub complete: bool,
    pub text: String,
}

#[derive(Serialize)]
pub struct Latency {
    pub mean: f64,
    pub max: f64,
}

/// The fraction of time that MCUs are awake.
#[derive(Serialize)]
pub struct CpuLoad {
    pub master: Load,
    pub slave: Load,
}

#[derive(Serialize)]
pub struct Load {
    pub mean: f64,
    pub max: f64,
}

impl Report {
    pub fn new(
        options: &Sim,
        run: &Run<impl Robot>,
        (wall, used): (Duration, &Used),
        cpu_load: Option<CpuLoad>,
        is_level: bool,
    ) -> Self {
        let Run { robot, observer, .. } = run;
        let modules = robot.wiring().modules();
        let mut types = BTreeMap::new();
        for module in (0..modules).filter(|&module| robot.is_on(module)) {
            let name = robot.status(module).map_or("Starting".into(), |is| format!("{:?}", is.module_type));
            *types.entry(name).or_default() += 1;
        }
        let seconds = |cycles: u64| cycles as f64 / f64::from(CLOCK_HZ);
        let simulated_seconds = seconds(robot.now());
        let wall_seconds = wall.as_secs_f64();
        let Observer { hops, discovery, gait, own_changes, .. } = observer;
        let reconfiguration = |Event { at, change }: &Event| Reconfiguration {
            at: seconds(*at),
            attach: match change {
                Change::Attach(one, other) => Some([one, other].map(Face::to_string)),
                _ => None,
            },
            detach: match change {
                Change::Detach(face) => Some(face.to_string()),
                _ => None,
            },
        };
        let console = |transcript: Transcript| Console {
            at: seconds(transcript.at),
            dock: transcript.face.to_string(),
            complete: transcript.is_complete,
            text: transcript.text,
        };
        let ms = |cycles: u64| cycles as f64 / MILLISECOND as f64;
        let us = |cycles: f64| cycles * 1000.0 / MILLISECOND as f64;
        let motion = robot.motion();
        let walked = motion.filter(|motion| motion.distance.hypot(motion.sideways) >= STANDS_M);
        let finite = |value: f64| value.is_finite().then_some(value);
        Report {
            engine: options.engine,
            core: matches!(options.engine, EngineName::Simavr).then(|| options.core()),
            modules,
            mcus: if cpu_load.is_some() { 2 * modules } else { 0 },
            simulated_seconds,
            wall_seconds,
            wall_ratio: wall_seconds / simulated_seconds,
            cost: used.since(modules, simulated_seconds),
            seed: options.seed,
            varied_percent: options.vary.iter().map(|it| (it.of.name(), it.percent)).collect(),
            loss: options.loss,
            types,
            topology_correct: (0..modules).all(|module| robot.is_right_by(&observer.audible, module)),
            hormones_sent: hops.sent,
            hormones_delivered: hops.delivered,
            hormones_dropped: hops.dropped,
            hormones_lost: hops.lost(),
            hormones_out_of_turn: hops.out_of_turn,
            hop_latency_us: hops.latency().map(|(mean, max)| Latency { mean: us(mean), max: us(max as f64) }),
            hop_over_wire: hops.latency_over_wire(),
            discovery_ms_max: discovery.found_after.map(ms),
            loss_notice_ms_max: discovery.lost_after.map(ms),
            topology_lapses: discovery.lapses,
            reconfigurations: own_changes.iter().map(reconfiguration).collect(),
            legs: gait.legs(),
            gait_violations: gait.violations(),
            leg_skew_us_max: gait.skew_max.map(|cycles| us(cycles as f64)),
            recovery_periods_max: gait.recovery_periods(),
            world: if motion.is_some() { WorldName::Ground } else { WorldName::None },
            distance_m: motion.map(|motion| motion.distance),
            body_lengths: motion.map(|motion| motion.distance / motion.length),
            sideways_percent: walked.and_then(|it| finite(100.0 * (it.sideways / it.distance).abs())),
            heading_degrees: motion.map(|motion| motion.heading),
            slip_percent: walked.and_then(|it| finite(100.0 * it.slip)),
            tilt_degrees_max: robot.tilt(),
            charge_percent_max: robot.charge_used().map(|used| 100.0 * used),
            metres_per_charge: walked
                .zip(robot.charge_used())
                .and_then(|(motion, used)| finite(motion.distance / used)),
            trouble: robot.trouble().map(Broken::of),
            cpu_load,
            link: robot.links(),
            bridge: robot.bridges(),
            consoles: robot.transcripts().into_iter().map(console).collect(),
            state_hash: format!("{:016x}", robot.state_hash()),
            faults: simulation::faults(run, is_level),
        }
    }

    /// The faults of the robot, a line each.
    pub fn faults(&self) -> &[String] {
        &self.faults
    }
}

impl CpuLoad {
    pub fn of(robot: &simavr_harness::Robot) -> Self {
        CpuLoad { master: load(robot, Controller::Master), slave: load(robot, Controller::Slave) }
    }
}

fn load(robot: &simavr_harness::Robot, controller: Controller) -> Load {
    let loads: Vec<f64> = (0..robot.modules())
        .filter_map(|module| robot.module(module))
        .map(|module| {
            let mcu = module.mcu(controller);
            let cycles = mcu.cycle().saturating_sub(module.powered_up_at());
            mcu.awake_cycles() as f64 / cycles.max(1) as f64
        })
        .collect();
    Load {
        mean: loads.iter().sum::<f64>() / loads.len().max(1) as f64,
        max: loads.iter().copied().fold(0.0, f64::max),
    }
}
