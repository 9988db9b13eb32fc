//! `./x gdb`: gdb on one MCU of a running robot. The whole robot stops while gdb has control.
//!
//! - `server`: speaks with gdb, which this process has started.
//! - `target`: the stopped MCU, as a target for gdb.
//! - `worker`: runs the robot, in another process, and stops it before instructions of the MCU.
//! - `history`: copies of that process, from which the robot runs again to go back.
//! - `order`: the messages between server and worker.

mod avr;
mod goal;
mod history;
mod order;
mod process;
mod server;
mod target;
mod worker;

use std::error::Error;
use std::io::Write;
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use simavr_harness::{Controller, Engine, Image, Mcu, Robot};
use simulation::{CLOCK_HZ, Robot as _, Run, Scenario};
use tempfile::NamedTempFile;

use super::arguments::{EngineName, Gdb, Sim};
use super::mcu_name::McuName;
use super::output::say;
use super::scenario;
use order::{Line, Report};
use process::Fork;
use worker::Shared;

/// The script for gdb: `info tasks`, and how to find the callers of a function.
const SCRIPT: &str = include_str!("superbot.py");

/// Returns whether gdb ended well.
pub fn run(options: &Gdb) -> Result<bool, Box<dyn Error>> {
    let Gdb { mcu: name, sim: sim_options, at, .. } = options;
    let scenario = scenario::of(sim_options)?;
    check(options, &scenario)?;
    scenario::check(sim_options, &scenario)?;
    let program = options.program();
    // This and the port are tried before the run takes its time.
    if options.listen.is_none() {
        let quiet = || Stdio::null();
        let mut gdb = Command::new(&program);
        start(gdb.arg("--version").stdin(quiet()).stdout(quiet()).stderr(quiet()))?.wait()?;
    }
    let mut robot = scenario::build_robot(&scenario, sim_options)?;
    let image = Arc::clone(find(&mut robot, *name)?.image());
    let (server, worker) = UnixStream::pair()?;
    if process::fork()? == Fork::Copy {
        drop(server);
        process::ignore_signals();
        work(robot, scenario, options, Line::new(worker))
    }
    drop((worker, robot));
    let mut worker = Line::new(server);
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, options.listen.unwrap_or(0)))
        .map_err(|error| format!("can't listen: {error}; give --listen another port"))?;
    let address = listener.local_addr()?;
    if *at > 0.0 {
        say(format_args!("superbot-sim: running up to {at} s\n"));
    }
    let first: Report = worker.receive().ok_or("the robot did not run: see the message above")?;
    if options.listen.is_some() {
        say(format_args!("superbot-sim: waiting for gdb: connect it with target remote {address}\n"));
        let (gdb, _) = listener.accept()?;
        server::serve(gdb, worker, image, first)?;
        return Ok(true);
    }
    let elf = debugging_information(sim_options, name.controller, &image);
    let script = script(elf.as_deref())?;
    let mut gdb = Command::new(&program);
    gdb.arg("-q");
    gdb.args(elf);
    gdb.arg("-ex").arg(format!("source {}", script.path().display()));
    gdb.arg("-ex").arg(format!("target remote {address}"));
    gdb.args(&options.gdb_arguments);
    let mut gdb = start(&mut gdb)?;
    process::ignore_interrupts();
    let served = match accept(&listener, &mut gdb)? {
        Some(stream) => server::serve(stream, worker, image, first),
        None => Ok(()),
    };
    if let Err(error) = &served {
        say(format_args!("superbot-sim: {error}\n"));
    }
    // gdb has the terminal until it quits.
    Ok(gdb.wait()?.success() && served.is_ok())
}

fn start(gdb: &mut Command) -> Result<Child, String> {
    gdb.spawn().map_err(|error| {
        let program = gdb.get_program().display();
        format!("can't start {program}: {error}; install gdb with `./x gdb`, or name another with --gdb")
    })
}

/// Checks that the options describe a robot that can be debugged.
fn check(options: &Gdb, scenario: &Scenario) -> Result<(), Box<dyn Error>> {
    let Sim { engine, json, record, trace, view, seconds, threads, .. } = &options.sim;
    if matches!(engine, EngineName::Host) {
        return Err("the native engine runs no MCUs: leave --engine out".into());
    }
    if json.is_some() || record.is_some() || trace.is_some() || view.is_some() {
        return Err("gdb also runs backward: leave --json, --record, --trace and --view to ./x sim".into());
    }
    if threads.is_some() {
        return Err("a robot in gdb runs on one thread: leave --threads out".into());
    }
    if options.at >= *seconds {
        return Err(format!("--at {}: the run ends at {seconds} s; see --seconds", options.at).into());
    }
    if options.mcu.module >= scenario.wiring.modules() {
        let last = scenario.wiring.modules().saturating_sub(1);
        return Err(format!("{}: the robot's modules are 0 to {last}", options.mcu).into());
    }
    Ok(())
}

fn find(robot: &mut Robot, name: McuName) -> Result<&mut Mcu, String> {
    let module = robot.module_mut(name.module).ok_or_else(|| format!("there is no {name}"))?;
    Ok(module.mcu_mut(name.controller))
}

/// Runs the robot for the server, on one thread, so that this process can be forked at any instruction.
fn work(mut robot: Robot, scenario: Scenario, options: &Gdb, server: Line) -> ! {
    let name = options.mcu;
    let _guard = server.stream().try_clone().map(EndIfPanicking);
    let Ok(mcu) = find(&mut robot, name) else { process::leave() };
    let worker = Shared::new(server, mcu, scenario::cycles(options.at));
    mcu.set_debugger(Box::new(worker.clone()));
    let mut run = scenario::begin(Engine::new(robot, 1), scenario.timeline, &options.sim);
    let end = scenario::cycles(options.sim.seconds);
    let mut told = Vec::new();
    loop {
        let step = run.step(end);
        tell_of_what_broke(&run.robot, &mut told);
        let Ok(mcu) = find(run.robot.robot_mut(), name) else { process::leave() };
        match step {
            Ok(true) => worker.with(|worker| worker.ask(mcu)),
            Ok(false) => break,
            Err(impossible) => say(format_args!("superbot-sim: {impossible}\n")),
        }
    }
    let text = end_of(&run);
    let Ok(mcu) = find(run.robot.robot_mut(), name) else { process::leave() };
    worker.with(|worker| worker.end(mcu, &text))
}

/// Ends all worker processes if this one panics, through the connection to the server that they share.
struct EndIfPanicking(UnixStream);

impl Drop for EndIfPanicking {
    fn drop(&mut self) {
        let _ = self.0.shutdown(Shutdown::Both);
    }
}

/// Prints which programs have crashed and how the world broke, unless that was `told` before.
fn tell_of_what_broke(engine: &Engine, told: &mut Vec<String>) {
    let mut broken = engine.crashes();
    broken.extend(engine.trouble().map(ToString::to_string));
    for what in broken.iter().filter(|what| !told.contains(what)) {
        say(format_args!("superbot-sim: {what}\n"));
    }
    *told = broken;
}

fn end_of(run: &Run<Engine>) -> String {
    let seconds = run.robot.cycle() as f64 / f64::from(CLOCK_HZ);
    let hash = run.robot.robot().state_hash();
    format!("superbot-sim: the run is over at {seconds} s, state hash {hash:016x}\n")
}

/// The file from which gdb reads the program: the one with debugging information if it is the same program.
fn debugging_information(options: &Sim, controller: Controller, image: &Image) -> Option<PathBuf> {
    let name = match controller {
        Controller::Master => "firmware-master.elf",
        Controller::Slave => "firmware-slave.elf",
    };
    let paths = [options.images.join("debug").join(name), options.images.join(name)];
    let is_same = |path: &PathBuf| Image::load(path).is_ok_and(|other| other.flash() == image.flash());
    let found = paths.into_iter().enumerate().find(|(_, path)| is_same(path));
    match &found {
        Some((0, _)) => {}
        Some(_) => say("superbot-sim: gdb has no source lines: `./x gdb` builds debugging information\n"),
        None => say("superbot-sim: gdb has no symbols: the MCU runs another image than those built last\n"),
    }
    found.map(|(_, path)| path)
}

/// The script for gdb, in a file, for the program in the file `elf`.
fn script(elf: Option<&Path>) -> Result<NamedTempFile, Box<dyn Error>> {
    let mut file = tempfile::Builder::new().suffix(".py").tempfile()?;
    // Where no depth is known, gdb guesses the caller itself.
    let depths = elf.and_then(|path| stack_bound::Image::load(path).ok());
    let depths = depths.map(|image| stack_bound::depths(&image)).unwrap_or_default();
    file.write_all(SCRIPT.as_bytes())?;
    write!(file, "\nDEPTHS.update({{")?;
    for (address, depth) in depths {
        write!(file, "{address}: {depth}, ")?;
    }
    writeln!(file, "}})")?;
    file.flush()?;
    Ok(file)
}

/// Waits until gdb connects; `None` if gdb ends before that.
fn accept(listener: &TcpListener, gdb: &mut Child) -> Result<Option<TcpStream>, Box<dyn Error>> {
    listener.set_nonblocking(true)?;
    loop {
        if let Ok((stream, _)) = listener.accept() {
            stream.set_nonblocking(false)?;
            return Ok(Some(stream));
        }
        if gdb.try_wait()?.is_some() {
            return Ok(None);
        }
        thread::sleep(Duration::from_millis(10));
    }
}
