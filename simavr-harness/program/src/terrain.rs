//! `./x terrain`: a centipede on all kinds of ground and through all kinds of mishaps, as a table.

use std::error::Error;
use std::fmt;

use hormone::gait::GaitName;
use serde::Serialize;
use simavr_harness::{Engine, Face, Images, RobotBuilder, Wiring};
use simulation::{MILLISECOND, Robot, Run, Scenario};
use tasks::dock::Dock;

use super::arguments::{Centipede, CoreName, Terrain};
use super::images::load_images;
use super::json::{Destination, tell};
use super::output::say;
use super::scenario::{POWER_UP_WITHIN, expect_in_simavr};

/// The time by which the legs have risen and the robot walks evenly, in s.
const RISEN: usize = 3;

/// The time of a mishap, and the time at which a robot that was cut is joined again, in s.
const MISHAP: usize = 5;
const JOINED: usize = 9;

/// A row of the table: a way to run the robot, and the part that is measured.
struct Row {
    name: &'static str,
    /// The robot file without the shape.
    file: String,
    /// The time from which the robot is measured, in s.
    from: usize,
    /// A module: the modules that are joined to it at the end are measured.
    with: usize,
}

/// The positions of all modules, second by second, and their state in the end.
struct Track {
    /// Positions by second, then by module, in m.
    places: Vec<Vec<[f64; 3]>>,
    wiring: Wiring,
    tilt: f64,
}

/// The results of a row.
#[derive(Serialize)]
struct Outcome {
    name: &'static str,
    /// The time from which the robot is measured.
    from_seconds: usize,
    modules: usize,
    distance_m: f64,
    sideways_m: f64,
    /// The most that a module with two legs leaned.
    tilt_degrees_max: f64,
    fell: bool,
    /// Its distance, relative to that on level ground in the same time.
    of_level: f64,
}

#[derive(Serialize)]
struct Table {
    modules: usize,
    seconds: u16,
    seed: u64,
    rows: Vec<Outcome>,
}

pub fn run(options: &Terrain) -> Result<(), Box<dyn Error>> {
    let destination = Destination::of(options.centipede.json.as_deref(), None)?;
    let images = load_images(&options.centipede.images, CoreName::Decoded)?;
    let rows = rows(options.centipede.modules)?;
    let mut tracks: Vec<(&str, Track)> = Vec::new();
    let mut outcomes = Vec::new();
    for row in &rows {
        if !tracks.iter().any(|(file, _)| *file == row.file) {
            say(format_args!("superbot-sim: {}\n", row.name));
            tracks.push((&row.file, track(options, &images, row)?));
        }
        let level = &tracks[0].1;
        let Some((_, track)) = tracks.iter().find(|(file, _)| *file == row.file) else { continue };
        outcomes.push(outcome(row, track, level));
    }
    let Centipede { modules, seed, .. } = options.centipede;
    let table = Table { modules, seconds: options.seconds, seed, rows: outcomes };
    tell(destination, &table)
}

/// The rows of the table, level ground first.
fn rows(modules: usize) -> Result<Vec<Row>, Box<dyn Error>> {
    let wiring = simulation::Shape::Centipede.wiring(modules)?;
    let cut = middle(&wiring).ok_or("a robot to be cut in two needs two branches: 10 modules at least")?;
    let Some(peer) = wiring.peer(cut) else { return Err("the cut needs two modules".into()) };
    let on = |name, world: &str| Row { name, file: format!("[world]\n{world}\n"), from: RISEN, with: 0 };
    let after = |name, event: &str| {
        let file = format!("[[event]]\nat = {MISHAP}\n{event}\n");
        Row { name, file, from: MISHAP, with: 0 }
    };
    let detach = format!("detach = \"{cut}\"");
    let attach = format!("{detach}\n[[event]]\nat = {JOINED}\nattach = [\"{cut}\", \"{peer}\"]");
    Ok(vec![
        Row { name: "level", file: String::new(), from: RISEN, with: 0 },
        on("10 degrees up", "slope_degrees = 10"),
        on("10 degrees down", "slope_degrees = -10"),
        on("steps of 20 mm", "steps = { from_m = 0.2, height_mm = 20, length_mm = 300, number = 20 }"),
        on("friction 0.3", "friction = 0.3"),
        on("friction 0.6", "friction = 0.6"),
        on("friction 1.0", "friction = 1.0"),
        on("mass 0.7", "module_kg = 0.7"),
        on("mass 1.3", "module_kg = 1.3"),
        Row { from: MISHAP + 2, ..after("turned over", "roll = 180") },
        after("a leg pulled off", "detach = \"2.Back\""),
        after("a joint of a leg jams", "joint = \"2.Motor2\"\nfault = \"jammed\""),
        after("a wire of a leg breaks", "joint = \"2.Motor2\"\nfault = \"open\""),
        after("a wiper of the trunk sticks", "joint = \"4.Motor1\"\nfault = \"stuck\""),
        after("two modules swapped", "swap = [2, 4]"),
        after("cut: the front part", &detach),
        Row { with: peer.module, ..after("cut: the rear part", &detach) },
        after("cut, joined again", &attach),
    ])
}

/// The place to cut a centipede: behind a spine that is followed by a branch, the middle one of all such
/// places.
fn middle(wiring: &Wiring) -> Option<Face> {
    let is_branch = |module| wiring.peer(Face { module, dock: Dock::Left }).is_some();
    let behind = |module| wiring.peer(Face { module, dock: Dock::Back });
    let cuts: Vec<Face> = (1..wiring.modules())
        .filter(|&module| !is_branch(module) && behind(module).is_some_and(|face| is_branch(face.module)))
        .map(|module| Face { module, dock: Dock::Back })
        .filter(|face| behind(face.module).is_some_and(|peer| peer.dock == Dock::Front))
        .collect();
    cuts.get(cuts.len() / 2).copied()
}

/// The robot of a run, before it has run.
pub fn on_terrain(
    options: &Centipede,
    images: &Images,
    wiring: &Wiring,
    terrain: &simulation::Terrain,
) -> Result<Engine, Box<dyn Error>> {
    expect_in_simavr(wiring.modules())?;
    let robot = RobotBuilder::wired(images.clone(), wiring)
        .seed(options.seed)
        .power_up_within(POWER_UP_WITHIN)
        .on_terrain(terrain)
        .build()?;
    Ok(Engine::new(robot, options.threads))
}

fn track(options: &Terrain, images: &Images, row: &Row) -> Result<Track, Box<dyn Error>> {
    let file = format!("modules = {}\nshape = \"centipede\"\n{}", options.centipede.modules, row.file);
    let Scenario { wiring, terrain, timeline, .. } = Scenario::from_toml(&file)?;
    let engine = on_terrain(&options.centipede, images, &wiring, &terrain.unwrap_or_default())?;
    let mut run = Run::new(engine, timeline, u64::from(GaitName::Centipede.gait().period()) * MILLISECOND);
    let mut places = Vec::new();
    for second in 0..=u64::from(options.seconds) {
        while run.step(second * 1000 * MILLISECOND)? {}
        if let Some(trouble) = run.robot.trouble() {
            return Err(format!("{}: {trouble}", row.name).into());
        }
        let place = |module| run.robot.robot().place(module);
        places.push((0..wiring.modules()).filter_map(place).collect());
    }
    let tilt = run.robot.tilt().unwrap_or_default();
    Ok(Track { places, wiring: run.robot.wiring().clone(), tilt })
}

impl Track {
    /// The mean way of `modules` since the second `from`: ahead and to the left, in m.
    fn way(&self, modules: &[usize], from: usize) -> [f64; 2] {
        let Some((start, end)) = self.places.get(from).zip(self.places.last()) else { return [0.0; 2] };
        [0, 1].map(|axis| {
            let ways = modules.iter().map(|&module| end[module][axis] - start[module][axis]);
            ways.sum::<f64>() / modules.len() as f64
        })
    }
}

fn outcome(row: &Row, track: &Track, level: &Track) -> Outcome {
    let modules = track.wiring.body(row.with);
    let [distance_m, sideways_m] = track.way(&modules, row.from);
    let all: Vec<usize> = (0..level.wiring.modules()).collect();
    Outcome {
        name: row.name,
        from_seconds: row.from,
        modules: modules.len(),
        distance_m,
        sideways_m,
        tilt_degrees_max: track.tilt,
        fell: track.tilt > FALLEN,
        of_level: distance_m / level.way(&all, row.from)[0],
    }
}

/// A robot has fallen if a module with two legs leans by more than this, in degrees.
pub const FALLEN: f64 = 45.0;

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Table { modules, seconds, seed, .. } = self;
        writeln!(f, "centipede of {modules}, up to {seconds} s after power-up, seed {seed}\n")?;
        writeln!(f, "| | modules | from | distance | sideways | tilt | fell | of level |")?;
        writeln!(f, "|---|---|---|---|---|---|---|---|")?;
        for row in &self.rows {
            let Outcome { name, modules, from_seconds, distance_m, sideways_m, tilt_degrees_max, .. } = row;
            let fell = if row.fell { "yes" } else { "no" };
            writeln!(
                f,
                "| {name} | {modules} | {from_seconds} s | {distance_m:.2} m | {sideways_m:+.2} m | \
                 {tilt_degrees_max:.0}° | {fell} | {:.2} |",
                row.of_level
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_a_robot_file_for_robots_of_any_size() {
        for modules in [10, 11, 12, 18, 21, 40] {
            for Row { name, file, .. } in rows(modules).unwrap() {
                let file = format!("modules = {modules}\nshape = \"centipede\"\n{file}");
                Scenario::from_toml(&file).unwrap_or_else(|error| panic!("{name} of {modules}: {error}"));
            }
        }
        assert!(rows(6).is_err());
    }

    #[test]
    fn a_robot_is_cut_between_two_branches() {
        let wiring = simulation::Shape::Centipede.wiring(18).unwrap();
        assert_eq!(middle(&wiring), Some(Face { module: 8, dock: Dock::Back }));
    }
}
