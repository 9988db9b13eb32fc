//! `./x sim --trace`: writes what MCUs did as a timeline for Perfetto, or the levels of their pins and buses.

mod bus;
mod events;
mod flows;
mod frames;
mod joints;
mod levels;
mod schedule;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::error::Error;
use std::path::Path;

use simavr_harness::{BusSignal, CONTROL_PROBE, Edge, Face, Robot, Slice, Trace};
use simulation::Recording;

use super::arguments::{EngineName, Sim, at_most};
use super::json::Destination;
use super::mcu_name::McuName;
use events::{Events, Track};
use flows::Passed;

/// The most seconds, summed over all MCUs: a file of 600 MB, which takes twice as much memory to make.
const MOST: f64 = 400.0;

/// A timeline to be written.
pub struct Timeline {
    destination: Destination,
    /// Whether levels are asked for.
    is_vcd: bool,
    mcus: Vec<McuName>,
}

/// The recorded data of a robot.
pub struct Noted {
    mcus: Vec<Traced>,
    /// The signals on the buses, by module.
    buses: BTreeMap<usize, Vec<Slice<BusSignal>>>,
}

/// The recorded data of an MCU.
pub struct Traced {
    name: McuName,
    trace: Trace,
    /// The edges of the probe of the joints' control.
    control: Vec<Edge>,
}

impl Timeline {
    /// Makes sure, before the run takes its time, that the timeline can be written if one is asked for, and
    /// that it overwrites neither the `robot_file` nor another result.
    ///
    /// # Errors
    /// The timeline can't be written, or the robot with its `modules` has no such MCUs.
    pub fn of(
        options: &Sim,
        robot_file: Option<&Path>,
        others: [Option<&Destination>; 2],
        modules: usize,
    ) -> Result<Option<Self>, Box<dyn Error>> {
        let Some(path) = &options.trace else { return Ok(None) };
        if path == Path::new("-") {
            return Err("the standard output has the summary: give --trace a file".into());
        }
        if matches!(options.engine, EngineName::Host) {
            return Err(
                "the native engine runs no MCUs: leave --trace out, or ask for --engine simavr".into()
            );
        }
        for (index, name) in options.trace_of.iter().enumerate() {
            if name.module >= modules {
                let last = modules.saturating_sub(1);
                return Err(format!("--trace-of {name}: the robot's modules are 0 to {last}").into());
            }
            if options.trace_of[..index].contains(name) {
                return Err(format!("--trace-of names {name} twice").into());
            }
        }
        let most = MOST / options.trace_of.len() as f64;
        if options.seconds > most {
            return Err(format!(
                "{} s of so many MCUs would make a file too large to view: trace {} s at most, or fewer MCUs",
                options.seconds,
                at_most(most)
            )
            .into());
        }
        let destination = Destination::file(path, robot_file, "--trace")?;
        if others.into_iter().flatten().any(|other| other.is(&destination)) {
            return Err(format!(
                "another option already writes {}: give --trace another path",
                path.display()
            )
            .into());
        }
        // Not by `extension`: a file whose whole name is `.vcd` has none.
        let is_vcd = path.as_os_str().to_ascii_lowercase().as_encoded_bytes().ends_with(b".vcd");
        Ok(Some(Timeline { destination, is_vcd, mcus: options.trace_of.clone() }))
    }

    /// Begins to record a robot that has not run yet.
    ///
    /// # Errors
    /// An image has no kernel.
    pub fn begin(&self, robot: &mut Robot) -> Result<(), Box<dyn Error>> {
        for &name in &self.mcus {
            let Some(module) = robot.module_mut(name.module) else { continue };
            let mcu = module.mcu_mut(name.controller);
            mcu.trace().map_err(|error| format!("{name}: {error}"))?;
            mcu.add_probe(CONTROL_PROBE);
            module.trace_bus();
        }
        Ok(())
    }

    /// Takes the data that were recorded.
    pub fn take(&self, robot: &mut Robot) -> Noted {
        let traced = |&name: &McuName| {
            let mcu = robot.module_mut(name.module)?.mcu_mut(name.controller);
            Some(Traced { name, trace: mcu.take_trace()?, control: mcu.take_edges(0) })
        };
        let mcus = self.mcus.iter().filter_map(traced).collect();
        let modules: BTreeSet<usize> = self.mcus.iter().map(|name| name.module).collect();
        let signals = |module: usize| Some((module, robot.module_mut(module)?.take_bus_signals()));
        Noted { mcus, buses: modules.into_iter().filter_map(signals).collect() }
    }

    /// Writes the timeline. `recording` has the hormones and the robot's wirings.
    ///
    /// # Errors
    /// The timeline can't be written.
    pub fn write(self, noted: &Noted, recording: &Recording) -> Result<(), Box<dyn Error>> {
        if self.is_vcd {
            return self.destination.write_text(&levels::write(&noted.mcus, &noted.buses)?);
        }
        self.destination.write_text(&events_of(noted, recording))
    }
}

fn events_of(Noted { mcus: traced, buses }: &Noted, recording: &Recording) -> String {
    let mut events = Events::default();
    let mut passed = HashMap::new();
    for (number, Traced { name, trace, control }) in traced.iter().enumerate() {
        events.name_mcu(number, &name.to_string());
        schedule::write(&mut events, number, trace);
        let mut next = schedule::tracks(trace);
        let mut track = || {
            next += 1;
            Track::new(number, next - 1)
        };
        joints::write(&mut events, track(), control, trace.end);
        for (port, serial) in trace.serial.iter().enumerate() {
            let Some(dock) = flows::dock(name.controller, port) else { continue };
            let at_dock = Passed {
                sent: frames::pieces(&serial.sent),
                received: frames::pieces(&serial.received),
                out: track(),
                into: track(),
            };
            let Passed { sent, received, out, into } = &at_dock;
            frames::write(&mut events, *out, &format!("{dock:?} sends"), sent, trace.end);
            frames::write(&mut events, *into, &format!("{dock:?} hears"), received, trace.end);
            passed.insert(Face { module: name.module, dock }, at_dock);
        }
        // The first traced MCU of a module shows the module's bus.
        let is_first = traced.iter().position(|other| other.name.module == name.module) == Some(number);
        if let Some(signals) = buses.get(&name.module).filter(|_| is_first) {
            bus::write(&mut events, track(), signals);
        }
    }
    let end = traced.iter().map(|traced| traced.trace.end).min().unwrap_or(0);
    flows::frames(&mut events, &passed, recording, end);
    flows::hormones(&mut events, traced, recording);
    events.finish()
}
