//! `./x sim`: runs a robot, shows it live, and reports how it did.

use std::error::Error;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

use simavr_harness::Engine;
use simulation::{CLOCK_HZ, Native, Scenario};

use super::arguments::{EngineName, Sim, Source};
use super::cost::Used;
use super::display::Display;
use super::json::{Destination, tell};
use super::output::say;
use super::record::{self, Record};
use super::report::{Console, CpuLoad, Report};
use super::scenario;
use super::trace::{Noted, Timeline};
use super::view::{Inspected, View};

/// Runs the robot. Returns whether it had no faults.
pub fn run(options: &Sim) -> Result<bool, Box<dyn Error>> {
    let robot_file = match &options.robot {
        Source::File(path) => Some(path.as_path()),
        Source::Shape(_) => None,
    };
    let report = Destination::of(options.json.as_deref(), robot_file)?;
    let scenario = scenario::of(options)?;
    let record = Record::of(options, robot_file, report.as_ref(), &scenario)?;
    let others = [report.as_ref(), record.as_ref().map(Record::destination)];
    let timeline = Timeline::of(options, robot_file, others, scenario.wiring.modules())?;
    scenario::check(options, &scenario)?;
    if options.view.is_some() {
        record::expect_small(scenario.wiring.modules(), options.seconds, "--view")?;
    }
    let results = Results { report, record, timeline };
    let used = Used::now();
    match options.engine {
        EngineName::Simavr => {
            let mut robot = scenario::build_robot(&scenario, options)?;
            if let Some(timeline) = &results.timeline {
                timeline.begin(&mut robot)?;
            }
            let engine = Engine::new(robot, options.threads());
            run_robot(engine, scenario, options, results, &used)
        }
        EngineName::Host => {
            let robot = scenario::build_native(&scenario, options)?;
            run_robot(robot, scenario, options, results, &used)
        }
    }
}

/// The results that are asked for besides the summary.
struct Results {
    report: Option<Destination>,
    record: Option<Record>,
    timeline: Option<Timeline>,
}

/// A robot that may have MCUs, which give more results.
trait Executing: Inspected {
    fn cpu_load(&self) -> Option<CpuLoad> {
        None
    }

    /// Takes the recorded data for a timeline.
    fn take_noted(&mut self, _timeline: &Timeline) -> Option<Noted> {
        None
    }
}

impl Executing for Native {}

impl Executing for Engine {
    fn cpu_load(&self) -> Option<CpuLoad> {
        Some(CpuLoad::of(self.robot()))
    }

    fn take_noted(&mut self, timeline: &Timeline) -> Option<Noted> {
        Some(timeline.take(self.robot_mut()))
    }
}

fn run_robot(
    robot: impl Executing,
    scenario: Scenario,
    options: &Sim,
    results: Results,
    used: &Used,
) -> Result<bool, Box<dyn Error>> {
    let Results { report: destination, record, timeline: trace } = results;
    // A browser opens the page, so it is not served before the robot is built.
    let mut view = View::of(options, &scenario)?;
    let Scenario { terrain, timeline, .. } = scenario;
    let is_level = terrain.is_none();
    let mut run = scenario::begin(robot, timeline, options);
    if record.is_some() || trace.is_some() {
        run.record(record::EVERY);
    }
    let end = scenario::cycles(options.seconds);
    if let Some((modules, until)) = run.observer.gait.unjudged(end) {
        let seconds = until as f64 / f64::from(CLOCK_HZ);
        say(format_args!(
            "superbot-sim: hormones may need until {seconds:.1} s to reach {modules} of the modules; this \
             run does not judge their gait; see --seconds\n"
        ));
    }
    let mut display = Display::new(options.json.is_none() || std::io::stderr().is_terminal());
    let started = Instant::now();
    if let Some(view) = &mut view {
        view.drive(options, &mut run, end, &mut display)?;
    } else {
        // An impossible event is a fault, which the report has. The run continues after it.
        while run.step(end).unwrap_or(true) {
            display.show(&run, end, started.elapsed());
        }
    }
    let wall = started.elapsed().saturating_sub(view.as_ref().map_or(Duration::ZERO, View::waited));
    display.show(&run, end, wall);
    display.finish();
    let report = Report::new(options, &run, (wall, used), run.robot.cpu_load(), is_level);
    for Console { at, dock, complete, text } in &report.consoles {
        let rest = if *complete { "" } else { "...\n" };
        say(format_args!("\nconsole at {dock}, asked at {at:.2} s:\n{text}{rest}\n"));
    }
    let recording = run.finish_recording();
    let recorded = record.zip(recording.as_ref());
    let recorded = recorded.map(|(record, recording)| record.write(&report, recording));
    let traced = trace.zip(recording.as_ref()).and_then(|(trace, recording)| {
        let noted = run.robot.take_noted(&trace)?;
        Some(trace.write(&noted, recording))
    });
    // The figures are printed even if these files can't be written.
    tell(destination, &report)?;
    recorded.transpose()?;
    traced.transpose()?;
    // If the world broke, the run did not come to its end, so no event lies after it.
    if let (None, to_come @ 1..) = (run.robot.trouble(), run.events_to_come().len()) {
        say(format_args!(
            "superbot-sim: events that come after the end and did not happen: {to_come}; see --seconds\n"
        ));
    }
    for fault in report.faults() {
        say(format_args!("superbot-sim: {fault}\n"));
    }
    if let Some(view) = view {
        view.end(&report, options, &run)?;
    }
    Ok(report.faults().is_empty())
}
