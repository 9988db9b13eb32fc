//! The robot that the options of a run ask for, and what happens to it.

use std::error::Error;

use hormone::gait::GaitName;
use simavr_harness::{Physics, RobotBuilder};
use simulation::{CLOCK_HZ, Change, Event, Links, MILLISECOND, Native, Run, Scenario};

use super::arguments::{EngineName, Sim, Source, WorldName};
use super::images::Flashed;

/// Modules power up at random times within this many cycles: 40 ms, in which each module probes each dock
/// once.
pub const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;

/// The most modules that simavr runs: more would take more memory than most machines have.
const SIMAVR_MODULES: usize = 1000;

/// The most modules that a world takes: a thousand are 9000 degrees of freedom.
const IN_WORLD: usize = 1000;

/// An error, because otherwise the figures would not show that the robot file's world is missing.
const NO_WORLD: &str = "the robot file has a table [world], but the run has no world: \
    take the table out, or ask for --world ground";

/// The robot that is asked for, and the events that happen to it.
///
/// # Errors
/// There is no such robot.
pub fn of(options: &Sim) -> Result<Scenario, Box<dyn Error>> {
    match &options.robot {
        Source::Shape(shape) => {
            let modules = options.modules.unwrap_or(shape.usual_modules());
            let wiring = shape.wiring(modules).map_err(|error| format!("{error}; see --modules"))?;
            let file = format!("shape = \"{}\"\nmodules = {modules}\n", shape.name());
            Ok(Scenario { wiring, terrain: None, images: Vec::new(), timeline: Vec::new(), file })
        }
        Source::File(path) => {
            if options.modules.is_some() {
                return Err("the robot file gives the number of modules: leave --modules out".into());
            }
            let text = std::fs::read_to_string(path)
                .map_err(|error| format!("can't read {}: {error}", path.display()))?;
            Ok(Scenario::from_toml(&text).map_err(|error| format!("{}: {error}", path.display()))?)
        }
    }
}

/// Checks that the options and the robot go together.
///
/// # Errors
/// They do not.
pub fn check(options: &Sim, scenario: &Scenario) -> Result<(), Box<dyn Error>> {
    if scenario.terrain.is_some() && !has_world(options) {
        return Err(NO_WORLD.into());
    }
    if !options.vary.is_empty() && !has_world(options) {
        return Err("--vary needs a world: ask for --world ground".into());
    }
    for (index, variation) in options.vary.iter().enumerate() {
        if options.vary[..index].iter().any(|before| before.of == variation.of) {
            return Err(format!("--vary {} is given twice", variation.of.name()).into());
        }
    }
    scenario.timeline.iter().try_for_each(|event| expect_possible(options, &event.change))?;
    if matches!(options.engine, EngineName::Simavr) {
        expect_in_simavr(scenario.wiring.modules())?;
    } else {
        if has_world(options) && scenario.wiring.modules() > IN_WORLD {
            let most = format!("a world takes up to {IN_WORLD} modules: ask for fewer, or for --world none");
            return Err(most.into());
        }
        if options.core.is_some() {
            return Err(
                "the native engine executes no images: leave --core out, or ask for --engine simavr".into()
            );
        }
        if !scenario.images.is_empty() {
            return Err(
                "the native engine executes no images: take each [[image]] out, or ask for --engine simavr"
                    .into(),
            );
        }
    }
    Ok(())
}

/// Checks that simavr runs `modules` modules.
///
/// # Errors
/// These are too many.
pub fn expect_in_simavr(modules: usize) -> Result<(), String> {
    if modules <= SIMAVR_MODULES {
        return Ok(());
    }
    Err(format!("simavr runs up to {SIMAVR_MODULES} modules: ask for fewer, or for --engine host"))
}

/// Checks that the files that a robot file names exist, and that the robot can lie on its ground.
///
/// # Errors
/// A file is missing, or the robot can't lie there.
pub fn expect_buildable(options: &Sim, scenario: &Scenario) -> Result<(), Box<dyn Error>> {
    if matches!(options.engine, EngineName::Simavr) {
        Flashed::load(scenario, options)?;
    }
    if let Some(terrain) = &scenario.terrain {
        Physics::on_terrain(&scenario.wiring, terrain, &options.vary, options.seed)?;
    }
    Ok(())
}

/// Checks that a change is possible with these options.
///
/// # Errors
/// It is not; the message says what to do.
pub fn expect_possible(options: &Sim, change: &Change) -> Result<(), String> {
    match (options.engine, change) {
        (_, Change::Push { .. }) if !has_world(options) => {
            Err("a push needs a world: ask for --world ground".into())
        }
        (EngineName::Host, Change::Slip { .. } | Change::Fault { .. }) if !has_world(options) => {
            Err("the native engine has no joints that could fail without a world: ask for --world ground"
                .into())
        }
        (EngineName::Host, Change::Console(_)) => {
            Err("the native engine has no console that answers: ask for --engine simavr".into())
        }
        _ => Ok(()),
    }
}

/// The event that `--loss` asks for, which comes before all events of a robot file.
pub fn loss(options: &Sim) -> Option<Event> {
    let change = Change::Loss { links: Links::All, probability: options.loss };
    (options.loss > 0.0).then_some(Event { at: 0, change })
}

/// A robot at the begin of its run.
pub fn begin<R: simulation::Robot>(robot: R, timeline: Vec<Event>, options: &Sim) -> Run<R> {
    let timeline = loss(options).into_iter().chain(timeline).collect();
    Run::new(robot, timeline, u64::from(GaitName::Centipede.gait().period()) * MILLISECOND)
}

/// Converts seconds to cycles.
pub fn cycles(seconds: f64) -> u64 {
    (seconds * f64::from(CLOCK_HZ)).round() as u64
}

/// Whether there is a world: by default only in simavr.
pub fn has_world(options: &Sim) -> bool {
    let unless_told = matches!(options.engine, EngineName::Simavr);
    options.world.map_or(unless_told, |world| matches!(world, WorldName::Ground))
}

/// A robot in the native engine, as the options ask for it.
///
/// # Errors
/// The robot can't lie on its ground.
pub fn build_native(scenario: &Scenario, options: &Sim) -> Result<Native, Box<dyn Error>> {
    let Scenario { wiring, terrain, .. } = scenario;
    let robot = Native::new(wiring.clone(), options.seed, POWER_UP_WITHIN);
    if !has_world(options) {
        return Ok(robot);
    }
    let terrain = terrain.clone().unwrap_or_default();
    let world = Physics::on_terrain(wiring, &terrain, &options.vary, options.seed)?;
    Ok(robot.within(Box::new(world)))
}

/// A robot in simavr, as the options ask for it.
///
/// # Errors
/// The robot can't be built.
pub fn build_robot(scenario: &Scenario, options: &Sim) -> Result<simavr_harness::Robot, Box<dyn Error>> {
    let Scenario { wiring, terrain, .. } = scenario;
    let Flashed { rest, others } = Flashed::load(scenario, options)?;
    let builder = RobotBuilder::wired(rest, wiring)
        .seed(options.seed)
        .power_up_within(POWER_UP_WITHIN)
        .varied(&options.vary);
    let builder =
        others.into_iter().fold(builder, |builder, (module, images)| builder.program(module, images));
    let terrain = terrain.clone().unwrap_or_default();
    let builder = if has_world(options) { builder.on_terrain(&terrain) } else { builder };
    Ok(builder.build()?)
}
