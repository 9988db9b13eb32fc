//! `./x sim --trace`: what MCUs did, as a timeline for Perfetto.

mod events;
mod mcu_name;
mod tasks;

use std::error::Error;
use std::path::Path;

use simavr_harness::{Robot, Trace};

pub use mcu_name::McuName;

use super::arguments::{EngineName, Sim};
use super::json::Destination;
use events::Events;

/// A timeline to be written.
pub struct Timeline {
    destination: Destination,
    mcus: Vec<McuName>,
}

/// What was noted of an MCU.
pub struct Traced {
    name: McuName,
    trace: Trace,
}

impl Timeline {
    /// Makes sure, before anything has taken its time, that the timeline can be written if one is asked for:
    /// not over the `robot_file`, nor where anything else goes.
    ///
    /// # Errors
    /// It can't, or there are no such MCUs among those of so many `modules`.
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
        let destination = Destination::file(path, robot_file, "--trace")?;
        if others.into_iter().flatten().any(|other| other.is(&destination)) {
            return Err(format!("{} is for another result: give --trace another", path.display()).into());
        }
        Ok(Some(Timeline { destination, mcus: options.trace_of.clone() }))
    }

    /// Has a robot that has not run yet take note.
    ///
    /// # Errors
    /// An image has no kernel.
    pub fn begin(&self, robot: &mut Robot) -> Result<(), Box<dyn Error>> {
        for &name in &self.mcus {
            let Some(module) = robot.module_mut(name.module) else { continue };
            module.mcu_mut(name.controller).trace().map_err(|error| format!("{name}: {error}"))?;
        }
        Ok(())
    }

    /// Takes what the robot has noted.
    pub fn take(&self, robot: &mut Robot) -> Vec<Traced> {
        let traced = |&name: &McuName| {
            let trace = robot.module_mut(name.module)?.mcu_mut(name.controller).take_trace()?;
            Some(Traced { name, trace })
        };
        self.mcus.iter().filter_map(traced).collect()
    }

    /// Writes the timeline.
    ///
    /// # Errors
    /// It can't be written.
    pub fn write(self, traced: &[Traced]) -> Result<(), Box<dyn Error>> {
        let mut events = Events::default();
        for (number, Traced { name, trace }) in traced.iter().enumerate() {
            events.name_mcu(number, &name.to_string());
            tasks::write(&mut events, number, trace);
        }
        self.destination.write_text(&events.finish())
    }
}
