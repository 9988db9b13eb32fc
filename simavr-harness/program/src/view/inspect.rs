//! Inspects the inside of a module.

use serde::Serialize;
use simavr_harness::{Context, Controller, Engine, Mcu, Module, Tasks};
use simulation::{CLOCK_HZ, Native, Robot, Transcript};
use tasks::dock::Dock;
use tasks::motor::Axis;

/// A robot whose modules can be inspected.
pub trait Inspected: Robot {
    /// The data that its simulation has of a module beyond those that all robots have.
    fn look(&self, _inspector: &mut Inspector) -> Machine {
        Machine::default()
    }
}

impl Inspected for Native {}

impl Inspected for Engine {
    fn look(&self, inspector: &mut Inspector) -> Machine {
        let Some(module) = self.robot().module(inspector.module) else { return Machine::default() };
        let links = Dock::ALL.into_iter().filter_map(|dock| {
            let counters = module.link_counters(dock)?;
            Some(Link {
                dock: format!("{dock:?}"),
                sent: counters.frames_sent,
                received: counters.frames_received,
                repeated: counters.retries,
                errors: counters.errors,
                gave_up: counters.gave_up,
            })
        });
        let body = module.body();
        let joints = [Axis::Front, Axis::Roll, Axis::Back].map(|axis| body.joint(axis));
        Machine {
            mcus: Controller::ALL.map(|controller| inspector.mcu(module, controller)).into(),
            links: links.collect(),
            amperes: Some(joints.map(|joint| joint.amperes())),
            battery: Some([body.battery.volts(), 100.0 * body.battery.charge()]),
        }
    }
}

/// Inspects one module repeatedly.
pub struct Inspector {
    module: usize,
    /// By MCU, the tasks of its program; `None` before the first inspection.
    tasks: [Option<Tasks>; 2],
    /// By MCU, the cycle of the last inspection, and the cycles that it had been awake by then.
    before: [(u64, u64); 2],
}

/// A module at a moment.
#[derive(Serialize)]
pub struct Inside {
    /// In seconds.
    at: f64,
    module: usize,
    is_on: bool,
    /// The counts of HORMONE, by name.
    counts: Vec<(&'static str, u16)>,
    /// The reading of the accelerometer, in multiples of the acceleration of gravity.
    acceleration: [f64; 3],
    #[serde(flatten)]
    machine: Machine,
    consoles: Vec<Console>,
}

/// The data of a module in simavr that a native one does not have.
#[derive(Default, Serialize)]
pub struct Machine {
    mcus: Vec<McuNow>,
    links: Vec<Link>,
    /// The currents in the motors.
    amperes: Option<[f64; 3]>,
    /// The battery's voltage, and its charge in percent.
    battery: Option<[f64; 2]>,
}

#[derive(Serialize)]
struct McuNow {
    name: &'static str,
    /// The fraction of the time since the last inspection.
    awake_percent: Option<f64>,
    tasks: Vec<TaskNow>,
}

#[derive(Serialize)]
struct TaskNow {
    name: String,
    state: String,
    /// Bytes of the stack, and those that were ever used.
    stack: u16,
    used: u16,
}

#[derive(Serialize)]
struct Link {
    dock: String,
    sent: u16,
    received: u16,
    repeated: u16,
    errors: u16,
    gave_up: u16,
}

/// The text that the console of a module has sent.
#[derive(Serialize)]
struct Console {
    /// The time at which it was asked, in seconds.
    asked: f64,
    text: String,
    is_complete: bool,
}

impl Inspector {
    pub fn of(module: usize) -> Self {
        Inspector { module, tasks: [None, None], before: [(0, 0); 2] }
    }

    /// Inspects the module now.
    pub fn look(&mut self, robot: &impl Inspected) -> Inside {
        let counts = robot.status(self.module).map_or_else(Vec::new, |status| {
            vec![
                ("received", status.hormones_received),
                ("sent", status.hormones_sent),
                ("unsent", status.hormones_unsent),
                ("made good", status.made_good),
                ("dropped", status.dropped),
                ("malformed", status.malformed),
                ("changes of neighbours", status.topology_changes),
            ]
        });
        let own = robot.transcripts().into_iter().filter(|transcript| transcript.face.module == self.module);
        let console =
            |Transcript { at, text, is_complete, .. }| Console { asked: seconds(at), text, is_complete };
        Inside {
            at: seconds(robot.now()),
            module: self.module,
            is_on: robot.is_on(self.module),
            counts,
            acceleration: robot.acceleration(self.module),
            consoles: own.map(console).collect(),
            machine: robot.look(self),
        }
    }

    fn mcu(&mut self, module: &Module, controller: Controller) -> McuNow {
        let mcu = module.mcu(controller);
        let tasks = &mut self.tasks[controller as usize];
        if tasks.is_none() {
            *tasks = Tasks::of(mcu).ok();
        }
        let now = (mcu.cycle(), mcu.awake_cycles());
        let before = std::mem::replace(&mut self.before[controller as usize], now);
        let passed = now.0.checked_sub(before.0).filter(|&passed| passed > 0 && before.0 > 0);
        let name = match controller {
            Controller::Master => "master",
            Controller::Slave => "slave",
        };
        McuNow {
            name,
            awake_percent: passed.map(|passed| 100.0 * (now.1 - before.1) as f64 / passed as f64),
            tasks: tasks.as_mut().map_or_else(Vec::new, |tasks| TaskNow::all(tasks, mcu)),
        }
    }
}

impl TaskNow {
    fn all(tasks: &mut Tasks, mcu: &Mcu) -> Vec<Self> {
        let contexts = tasks.look(mcu);
        let now = |context: &Context| TaskNow {
            name: context.name.to_string(),
            state: context.state.to_string(),
            stack: context.stack,
            used: tasks.used(mcu, context),
        };
        contexts.iter().map(now).collect()
    }
}

fn seconds(cycles: u64) -> f64 {
    cycles as f64 / f64::from(CLOCK_HZ)
}
