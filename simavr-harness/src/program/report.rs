//! How the robot did, for people and as JSON.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt;
use std::time::Duration;

use serde::Serialize;
use simavr_harness::{CLOCK_HZ, Controller, Robot};

use super::observer::Observer;
use super::view;

/// The summary. Fields are only ever added: people's CI reads them.
#[derive(Serialize)]
pub struct Report {
    pub modules: usize,
    pub mcus: usize,
    pub simulated_seconds: f64,
    pub wall_seconds: f64,
    /// How many modules have found themselves to be of each type.
    pub types: BTreeMap<String, usize>,
    /// Every module's own view of its neighbours and its type equals the wiring.
    pub topology_correct: bool,
    /// Hormones handed to links, one for each dock that a hormone left by.
    pub hormones_sent: u64,
    pub hormones_delivered: u64,
    pub hormones_lost: u64,
    /// Hormones that came to a module with the same data as the one before, where A and B alternate.
    pub hormones_out_of_turn: u64,
    pub hop_latency_us: Option<Latency>,
    pub cpu_load: CpuLoad,
    pub link: Link,
    pub bridge: Bridge,
    /// Over the RAM, registers and clocks of all MCUs, in hexadecimal.
    pub state_hash: String,
    #[serde(skip)]
    faults: Vec<String>,
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

/// Sums over all docks, as the firmware counts them.
#[derive(Default, Serialize)]
pub struct Link {
    pub frames: u64,
    pub retries: u64,
    /// Arrivals that are no frame, and bytes lost on the way in.
    pub errors: u64,
    pub gave_up: u64,
    pub no_buffer: u64,
}

/// Sums over all bridges between the MCUs of a module, as the firmware counts them.
#[derive(Default, Serialize)]
pub struct Bridge {
    pub messages: u64,
    pub retries: u64,
    pub errors: u64,
    pub gave_up: u64,
    pub no_buffer: u64,
}

impl Report {
    pub fn new(robot: &Robot, observer: &Observer, end: u64, wall: Duration) -> Result<Self, Box<dyn Error>> {
        let modules = robot.modules();
        let mut types = BTreeMap::new();
        for module in 0..modules {
            let status = view::status(robot, module)
                .ok_or("the master's image has no readable MODULE_STATUS: build both with `./x build`")?;
            *types.entry(format!("{:?}", status.module_type)).or_default() += 1;
        }
        let mut report = Report {
            modules,
            mcus: 2 * modules,
            simulated_seconds: end as f64 / f64::from(CLOCK_HZ),
            wall_seconds: wall.as_secs_f64(),
            types,
            topology_correct: (0..modules).all(|module| view::is_right(robot, module)),
            hormones_sent: observer.sent,
            hormones_delivered: observer.delivered,
            hormones_lost: observer.lost(),
            hormones_out_of_turn: observer.out_of_turn,
            hop_latency_us: observer.hop_latency_us().map(|(mean, max)| Latency { mean, max }),
            cpu_load: CpuLoad {
                master: load(robot, Controller::Master),
                slave: load(robot, Controller::Slave),
            },
            link: links(robot),
            bridge: bridges(robot),
            state_hash: format!("{:016x}", robot.state_hash()),
            faults: Vec::new(),
        };
        report.faults = report.find_faults(robot);
        Ok(report)
    }

    /// Whether the robot did as it should.
    pub fn is_right(&self) -> bool {
        self.faults.is_empty()
    }

    /// What it did not do as it should, a line each.
    pub fn faults(&self) -> &[String] {
        &self.faults
    }

    fn find_faults(&self, robot: &Robot) -> Vec<String> {
        let mut faults = Vec::new();
        for (module, controller, reason) in robot.crashes() {
            faults.push(format!("module {module}: the {controller:?} MCU crashed: {reason}"));
        }
        for module in (0..self.modules).filter(|&module| !view::is_right(robot, module)) {
            let wiring = view::wiring(robot, module);
            let seen = view::status(robot, module)
                .and_then(|status| Some((status.module_type, status.neighbours()?)));
            faults.push(format!("module {module} is wired {wiring:?}, but sees {seen:?}"));
        }
        if self.hormones_delivered == 0 {
            faults.push("no hormone was delivered: run longer, or look at the types".into());
        }
        if self.hormones_lost > 0 {
            faults.push(format!("{} hormones were lost", self.hormones_lost));
        }
        if self.hormones_out_of_turn > 0 {
            faults.push(format!("{} hormones repeated the one before", self.hormones_out_of_turn));
        }
        faults
    }
}

fn load(robot: &Robot, controller: Controller) -> Load {
    let loads: Vec<f64> = (0..robot.modules())
        .filter_map(|module| robot.module(module))
        .map(|module| {
            let mcu = module.mcu(controller);
            mcu.awake_cycles() as f64 / mcu.cycle().max(1) as f64
        })
        .collect();
    Load {
        mean: loads.iter().sum::<f64>() / loads.len().max(1) as f64,
        max: loads.iter().copied().fold(0.0, f64::max),
    }
}

fn links(robot: &Robot) -> Link {
    let mut sum = Link::default();
    for counters in mcus(robot).flat_map(view::links) {
        sum.frames += u64::from(counters.frames_sent);
        sum.retries += u64::from(counters.retries);
        sum.errors += u64::from(counters.errors) + u64::from(counters.overruns);
        sum.gave_up += u64::from(counters.gave_up);
        sum.no_buffer += u64::from(counters.no_buffer);
    }
    sum
}

fn bridges(robot: &Robot) -> Bridge {
    let mut sum = Bridge::default();
    for counters in mcus(robot).filter_map(view::bridge) {
        sum.messages += u64::from(counters.messages_sent);
        sum.retries += u64::from(counters.retries);
        sum.errors += u64::from(counters.errors);
        sum.gave_up += u64::from(counters.gave_up);
        sum.no_buffer += u64::from(counters.no_buffer);
    }
    sum
}

fn mcus(robot: &Robot) -> impl Iterator<Item = &simavr_harness::Mcu> {
    (0..robot.modules())
        .filter_map(|module| robot.module(module))
        .flat_map(|module| [Controller::Master, Controller::Slave].map(|controller| module.mcu(controller)))
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Report { modules, mcus, simulated_seconds, wall_seconds, .. } = self;
        let types: Vec<String> = self.types.iter().map(|(name, number)| format!("{number} {name}")).collect();
        let topology = if self.topology_correct { "as wired" } else { "NOT as wired" };
        writeln!(
            f,
            "{modules} modules, {mcus} MCUs: {simulated_seconds} s simulated in {wall_seconds:.2} s"
        )?;
        writeln!(f, "types      {} ({topology})", types.join(", "))?;
        writeln!(
            f,
            "hormones   {} sent, {} delivered, {} lost, {} out of turn",
            self.hormones_sent, self.hormones_delivered, self.hormones_lost, self.hormones_out_of_turn
        )?;
        if let Some(Latency { mean, max }) = self.hop_latency_us {
            writeln!(f, "hop        {mean:.0} us mean, {max:.0} us at most")?;
        }
        writeln!(
            f,
            "CPU awake  master {:.1} % (at most {:.1} %), slave {:.1} % (at most {:.1} %)",
            100.0 * self.cpu_load.master.mean,
            100.0 * self.cpu_load.master.max,
            100.0 * self.cpu_load.slave.mean,
            100.0 * self.cpu_load.slave.max
        )?;
        let Link { frames, retries, errors, gave_up, no_buffer } = self.link;
        writeln!(
            f,
            "links      {frames} frames, {retries} repeated, {errors} errors, {gave_up} messages given up, \
             {no_buffer} without a buffer"
        )?;
        let Bridge { messages, retries, errors, gave_up, no_buffer } = self.bridge;
        writeln!(
            f,
            "bridges    {messages} messages, {retries} repeated, {errors} errors, {gave_up} given up, \
             {no_buffer} without a buffer"
        )?;
        writeln!(f, "state hash {}", self.state_hash)
    }
}
