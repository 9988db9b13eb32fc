//! Measures how fast instructions are executed by the interpreter of the harness, by simavr's own, and by
//! QEMU.
//!
//! The first two run the same programs to the same state, one after the other in each round, so that other
//! load of the machine affects both. The quickest round counts. QEMU has no ATmega128, and no cycles: it runs
//! a program for the ATmega2560 that marks its begin and its end.

use std::io::{ErrorKind, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::image::Image;
use crate::mcu::{Mcu, State};
use crate::module::Images;
use crate::part::Part;
use crate::robot::RobotBuilder;
use simulation::{CLOCK_HZ, Shape};

/// The number of the robot's modules, and the cycles for which it runs.
const MODULES: usize = 10;
const ROBOT_RUNS: u64 = 2 * CLOCK_HZ as u64;

/// Programs of one MCU: name, image under the directory of the images, and the most cycles for which it runs.
const PROGRAMS: [(&str, &str, u64); 3] = [
    ("computes", "tests/canary-3/canary.elf", 40_000_000),
    ("switches tasks", "tests/bench_tasks.elf", 40_000_000),
    ("sends and receives", "tests/bench_queue.elf", 40_000_000),
];

/// The program that QEMU runs, too, and the most cycles for which it runs.
const MARKED: (&str, &str, u64) = ("computes and switches", "tests/qemu/atmega2560/pace.elf", 400_000_000);

/// The time that a program takes with each interpreter.
#[derive(Clone, Debug, Serialize)]
pub struct Pace {
    pub program: &'static str,
    /// Instructions that it executes; `None` for a robot, whose MCUs are not stepped.
    pub instructions: Option<u64>,
    /// Simulated time, in s.
    pub simulated_seconds: f64,
    /// Wall time with the interpreter of the harness, in s, in the quickest round.
    pub decoded_seconds: f64,
    /// Wall time with simavr's own interpreter, in s, in the quickest round.
    pub simavr_seconds: f64,
    /// Wall time in QEMU, in s, from the program's first mark to its second, in the quickest round; `None` if
    /// QEMU does not run the program or is not installed.
    pub qemu_seconds: Option<f64>,
}

impl Pace {
    /// How many times faster the interpreter of the harness is.
    pub fn ratio(&self) -> f64 {
        self.simavr_seconds / self.decoded_seconds
    }
}

/// Measures all programs whose images are in `directory`, in `rounds` rounds, at least one. In each round a
/// program runs with each interpreter. Runs on one thread.
///
/// # Errors
/// An image does not exist, or the interpreters come to different states.
pub fn measure(directory: &Path, rounds: usize) -> Result<Vec<Pace>, BenchError> {
    let mut paces = Vec::new();
    for (program, path, cycles) in PROGRAMS {
        paces.push(of_program(program, Part::ATMEGA128, &directory.join(path), cycles, rounds)?);
    }
    let (program, path, cycles) = MARKED;
    let path = directory.join(path);
    let mut marked = of_program(program, Part::ATMEGA2560, &path, cycles, rounds)?;
    marked.qemu_seconds = in_qemu(&path, rounds)?;
    paces.push(marked);
    paces.push(of_robot(directory, rounds)?);
    Ok(paces)
}

/// The image for the harness's interpreter, and for simavr's.
fn both(path: &Path) -> Result<[Arc<Image>; 2], BenchError> {
    Ok([Arc::new(Image::load(path)?), Arc::new(Image::load(path)?.undecoded())])
}

fn of_program(
    program: &'static str,
    part: &'static Part,
    path: &Path,
    cycles: u64,
    rounds: usize,
) -> Result<Pace, BenchError> {
    let images = both(path)?;
    let start = |image: &Arc<Image>| Mcu::new(part, Arc::clone(image), 1);
    let [decoded, simavr] = quickest(program, rounds, &images, |image| {
        let mut mcu = start(image)?;
        let begin = Instant::now();
        mcu.run_until(cycles);
        Ok((begin.elapsed(), mcu.state_hash()))
    })?;
    let mut mcu = start(&images[0])?;
    let instructions = instructions(&mut mcu, cycles);
    let simulated_seconds = mcu.cycle() as f64 / f64::from(CLOCK_HZ);
    Ok(Pace {
        program,
        instructions: Some(instructions),
        simulated_seconds,
        decoded_seconds: decoded,
        simavr_seconds: simavr,
        qemu_seconds: None,
    })
}

/// Runs until `cycle` or the program's end, through any sleep. Returns the number of instructions executed.
pub fn instructions(mcu: &mut Mcu, cycle: u64) -> u64 {
    let mut instructions = 0;
    while mcu.cycle() < cycle && mcu.is_alive() {
        let (runs, awake) = (mcu.state() == State::Running, mcu.awake_cycles());
        mcu.step();
        instructions += u64::from(runs && mcu.awake_cycles() != awake);
    }
    instructions
}

/// The shortest time, in s, from the program's first byte at its serial port to its second.
fn in_qemu(path: &Path, rounds: usize) -> Result<Option<f64>, BenchError> {
    let failed = |error: std::io::Error| unmeasurable("qemu-system-avr", error.to_string());
    let mut shortest: Option<f64> = None;
    for _ in 0..rounds {
        let qemu = Command::new("qemu-system-avr")
            .args([
                "-display", "none", "-monitor", "none", "-serial", "stdio", "-machine", "mega2560", "-bios",
            ])
            .arg(path)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut qemu = match qemu {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            qemu => qemu.map_err(failed)?,
        };
        let took = qemu.stdout.take().map(|mut marks| {
            let mut mark = [0];
            marks.read_exact(&mut mark)?;
            let begin = Instant::now();
            marks.read_exact(&mut mark).map(|()| begin.elapsed().as_secs_f64())
        });
        // QEMU does not end by itself.
        qemu.kill().and_then(|()| qemu.wait()).map_err(failed)?;
        let took = took.transpose().map_err(failed)?;
        shortest = [shortest, took].into_iter().flatten().reduce(f64::min);
    }
    Ok(shortest)
}

/// A centipede that walks, without a world.
fn of_robot(directory: &Path, rounds: usize) -> Result<Pace, BenchError> {
    let program = "a centipede of ten";
    let [master, slave] =
        ["firmware-master.elf", "firmware-slave.elf"].map(|name| both(&directory.join(name)));
    let ([master, left_master], [slave, left_slave]) = (master?, slave?);
    let robots = [Images { master, slave }, Images { master: left_master, slave: left_slave }];
    let wiring =
        Shape::Centipede.wiring(MODULES).map_err(|error| unmeasurable("robot", error.to_string()))?;
    let [decoded, simavr] = quickest(program, rounds, &robots, |images| {
        let robot = RobotBuilder::wired(images.clone(), &wiring).seed(1).build()?;
        let mut engine = Engine::new(robot, 1);
        let begin = Instant::now();
        engine.run_until(ROBOT_RUNS);
        Ok((begin.elapsed(), engine.robot().state_hash()))
    })?;
    let simulated_seconds = ROBOT_RUNS as f64 / f64::from(CLOCK_HZ);
    Ok(Pace {
        program,
        instructions: None,
        simulated_seconds,
        decoded_seconds: decoded,
        simavr_seconds: simavr,
        qemu_seconds: None,
    })
}

/// The shortest time, in s, that each of `subjects` takes to run.
fn quickest<T>(
    program: &str,
    rounds: usize,
    subjects: &[T; 2],
    run: impl Fn(&T) -> Result<(Duration, u64), BenchError>,
) -> Result<[f64; 2], BenchError> {
    let mut shortest = [f64::INFINITY; 2];
    for _ in 0..rounds.max(1) {
        let [one, other] = [run(&subjects[0])?, run(&subjects[1])?];
        if one.1 != other.1 {
            return Err(unmeasurable("interpreters", format!("{program}: they come to different states")));
        }
        for (shortest, (took, _)) in shortest.iter_mut().zip([one, other]) {
            *shortest = shortest.min(took.as_secs_f64());
        }
    }
    Ok(shortest)
}
