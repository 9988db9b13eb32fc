//! The runs of a campaign, each with its name, its parameters and its command.

use std::collections::BTreeSet;
use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};
use serde::{Deserialize, Serialize};
use simulation::fnv_1a;

use super::super::arguments::{CoreName, EngineName, Sim, Source};
use super::super::images::load_images;
use super::super::scenario;
use super::file::{self, Line};

/// The most bytes of a key. A file's name has up to 255 bytes, and has an extension after the key.
const LONGEST_KEY: usize = 240;

/// The bytes of a key that stay readable if a hash distinguishes it from others.
const STEM: usize = 160;

/// All runs of a campaign, in the order of the list.
#[derive(Serialize, Deserialize)]
pub struct Plan {
    pub runs: Vec<Planned>,
}

/// A planned run.
#[derive(Serialize, Deserialize)]
pub struct Planned {
    /// Its name. It follows from the parameters, so it stays the same when the campaign grows.
    pub key: String,
    /// The program and its arguments.
    pub command: Line,
    pub parameters: Parameters,
}

/// The parameters by which runs differ, each with the value that `./x sim` uses, including defaults.
#[derive(Clone, Serialize, Deserialize)]
pub struct Parameters {
    pub robot: String,
    pub modules: usize,
    pub engine: String,
    pub world: String,
    pub seconds: f64,
    pub loss: f64,
    /// The variations from module to module, separated by blanks.
    pub vary: String,
    pub seed: u64,
}

impl Plan {
    /// The runs that a campaign file asks for. Those in simavr take the images in `images`.
    ///
    /// # Errors
    /// The file can't be read, is not a campaign, or has a run that `./x sim` would refuse.
    pub fn of_file(path: &Path, images: &Path) -> Result<Self, Box<dyn Error>> {
        let text = super::read(path)?;
        let directory = path.parent().unwrap_or(Path::new(""));
        let program = std::env::current_exe()?;
        let images = std::path::absolute(images)?;
        let plan = file::lines(&text, directory)
            .map_err(Into::into)
            .and_then(|lines| Self::of(lines, &program, &images));
        let plan = plan.map_err(|error| format!("{}: {error}", path.display()))?;
        let simavr = engine_name(EngineName::Simavr);
        if plan.runs.iter().any(|run| run.parameters.engine == simavr) {
            load_images(&images, CoreName::Decoded)?;
        }
        Ok(plan)
    }

    fn of(lines: Vec<Line>, program: &Path, images: &Path) -> Result<Self, Box<dyn Error>> {
        let mut keys = BTreeSet::new();
        let mut plan = Plan { runs: Vec::new() };
        let mut checked: Option<(Line, usize)> = None;
        let mut built = BTreeSet::new();
        for line in lines {
            let options = Sim { images: images.into(), ..parse(&line)? };
            // The seed affects neither the checks nor the number of modules.
            let rest = without_seed(&line);
            let modules = match checked.take() {
                Some((before, modules)) if before == rest => modules,
                _ => {
                    check(&options, &mut built).map_err(|error| format!("sim {}: {error}", line.join(" ")))?
                }
            };
            checked = Some((rest, modules));
            let parameters = Parameters::of(&options, modules);
            let key = parameters.key();
            if !keys.insert(key.clone()) {
                return Err(format!("the file asks for the run {key} twice: give each value once").into());
            }
            let mut command = vec![super::text(program)?, "sim".into()];
            command.extend(line);
            // One run on each core at a time takes less time than one run after the other on all cores.
            command.extend(["--threads", "1"].map(String::from));
            if matches!(options.engine, EngineName::Simavr) {
                command.extend(["--images".into(), super::text(images)?]);
            }
            plan.runs.push(Planned { key, command, parameters });
        }
        Ok(plan)
    }
}

fn without_seed(line: &Line) -> Line {
    line.iter().take_while(|argument| *argument != "--seed").cloned().collect()
}

/// What `sim` takes.
#[derive(Parser)]
#[command(no_binary_name = true)]
struct Run {
    #[command(flatten)]
    options: Sim,
}

fn parse(line: &Line) -> Result<Sim, Box<dyn Error>> {
    match Run::try_parse_from(line) {
        Ok(Run { options }) => Ok(options),
        // The rest of the message is about the usage of another command.
        Err(error) => {
            let text = error.to_string();
            let text = text.split("\n\n").next().unwrap_or_default();
            Err(text.trim_start_matches("error: ").to_owned().into())
        }
    }
}

/// Checks a run, and returns the number of its modules. `built` has the robot files that were checked before:
/// each path, and whether for simavr.
fn check(options: &Sim, built: &mut BTreeSet<(PathBuf, bool)>) -> Result<usize, Box<dyn Error>> {
    let scenario = scenario::of(options)?;
    scenario::check(options, &scenario)?;
    if let Source::File(path) = &options.robot
        && built.insert((path.clone(), matches!(options.engine, EngineName::Simavr)))
    {
        scenario::expect_buildable(options, &scenario)?;
    }
    Ok(scenario.wiring.modules())
}

impl Parameters {
    fn of(options: &Sim, modules: usize) -> Self {
        let robot = match &options.robot {
            Source::Shape(shape) => shape.name().into(),
            Source::File(path) => shown(path),
        };
        let vary: Vec<_> =
            options.vary.iter().map(|it| format!("{}={}%", it.of.name(), it.percent)).collect();
        Parameters {
            robot,
            modules,
            engine: engine_name(options.engine),
            world: if scenario::has_world(options) { "ground" } else { "none" }.into(),
            seconds: options.seconds,
            loss: options.loss,
            vary: vary.join(" "),
            seed: options.seed,
        }
    }

    /// The name of this run's files, which no other run has.
    fn key(&self) -> String {
        let Parameters { robot, modules, engine, world, seconds, loss, vary, seed } = self;
        let vary = if vary.is_empty() { String::new() } else { format!(".{vary}") };
        let rest = format!("-{modules}.{engine}.{world}.{seconds}s.loss-{loss}{vary}.seed-{seed}");
        let plain =
            |letter: char| if letter.is_alphanumeric() || ".-".contains(letter) { letter } else { '_' };
        let mut key: String = robot.chars().chain(rest.chars()).map(plain).collect();
        // In `rest` only marks between names and numbers are replaced, so no two runs become alike.
        if key.starts_with(robot) && key.len() <= LONGEST_KEY {
            return key;
        }
        let hash = fnv_1a(robot.bytes().chain(rest.bytes()));
        while key.len() > STEM {
            key.pop();
        }
        format!("{key}.hash-{hash:016x}")
    }
}

fn engine_name(engine: EngineName) -> String {
    engine.to_possible_value().map_or_else(String::new, |it| it.get_name().into())
}

/// The path of a robot file, relative to the current directory if the file is below it.
fn shown(path: &Path) -> String {
    let here =
        std::env::current_dir().and_then(|here| here.canonicalize()).unwrap_or_else(|_| PathBuf::new());
    path.strip_prefix(here).unwrap_or(path).display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(text: &str) -> Result<Plan, Box<dyn Error>> {
        Plan::of(file::lines(text, Path::new("."))?, Path::new("/bin/superbot-sim"), Path::new("/images"))
    }

    #[test]
    fn a_run_has_a_name_of_its_parameters_and_a_whole_command() {
        let plan = plan("engine = ['host', 'simavr']\nseconds = 2\nloss = 0.25\nseed = 7").unwrap();
        let keys: Vec<_> = plan.runs.iter().map(|run| run.key.as_str()).collect();
        assert_eq!(
            keys,
            [
                "centipede-100.host.none.2s.loss-0.25.seed-7",
                "centipede-100.simavr.ground.2s.loss-0.25.seed-7"
            ]
        );
        let commands: Vec<_> = plan.runs.iter().map(|run| run.command.join(" ")).collect();
        let host = "/bin/superbot-sim sim --engine host --seconds 2 --loss 0.25 --seed 7 --threads 1";
        assert_eq!(commands[0], host);
        assert_eq!(commands[1], host.replace("host", "simavr") + " --images /images");
    }

    #[test]
    fn a_run_with_a_name_that_a_file_can_not_have_is_told_from_others_by_a_hash() {
        let key = |robot: &str, loss, vary: &str| {
            let (robot, vary) = (robot.into(), vary.into());
            let (engine, world) = ("host".into(), "none".into());
            Parameters { robot, modules: 2, engine, world, seconds: 2.0, loss, vary, seed: 7 }.key()
        };
        let plain = key("legs_x.toml", 0.0, "mass=20% torque=1.5%");
        assert_eq!(plain, "legs_x.toml-2.host.none.2s.loss-0.mass_20__torque_1.5_.seed-7");
        let long = "ä".repeat(120) + ".toml";
        let keys = [
            key("legs_x.toml", 0.0, ""),
            key("legs/x.toml", 0.0, ""),
            key("legs x.toml", 0.0, ""),
            key("legs..x.toml", 0.0, ""),
            key("legs.x.toml", 0.0, ""),
            key(&long, 0.0, ""),
            key(&long, 0.1, ""),
            key("chain", 1e-300, ""),
            key("chain", 2e-300, ""),
        ];
        assert!(keys[1].starts_with("legs_x.toml-2.host.none.2s.loss-0.seed-7.hash-"), "{}", keys[1]);
        assert!(keys.iter().all(|key| key.len() <= LONGEST_KEY), "{keys:#?}");
        assert_eq!(BTreeSet::from(keys).len(), 9);
    }

    #[test]
    fn what_the_simulator_would_refuse_is_refused_before_anything_runs() {
        for (text, advice) in [
            ("loss = [0.1, 2]", "give a probability from 0 to 1"),
            ("seed = 'x'", "--seed"),
            ("seed = -1", "--seed"),
            ("engine = 'qemu'", "possible values: simavr, host"),
            ("robot = 'square'", "give one of centipede, chain, ring"),
            ("robot = ''", "give one of centipede, chain, ring"),
            (
                "engine = 'host'\nworld = ['none', 'ground']\nrobot = { shape = 'chain', modules = 1001 }",
                "up to 1000 modules",
            ),
            ("robot = { shape = 'chain', modules = [5, 1001] }", "simavr runs up to 1000 modules"),
            ("engine = 'host'\nvary = 'mass=20%'", "--vary"),
            ("robot = { shape = 'six-legs', modules = 2 }", "at least 11 modules"),
            ("loss = [0.3, 0.3]", "twice: give each value once"),
            ("seconds = [1, 1.0]", "twice: give each value once"),
            ("loss = [0.0, -0.0]", "twice: give each value once"),
            ("vary = ['mass=0%', 'mass=-0%']", "twice: give each value once"),
        ] {
            let error = plan(text).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains(advice), "{text}: {error}");
        }
    }
}
