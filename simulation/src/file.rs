//! Robots from TOML files; docs/robot-files.md has the format.

use std::collections::BTreeSet;
use std::ops::Range;

use hormone::hormone::Hormone;
use serde::Deserialize;
use tasks::dock::Dock;
use tasks::message::MAX_PAYLOAD;
use tasks::motor::Axis;
use thiserror::Error;
use toml::Spanned;

use crate::change::{Change, Links, Mcus};
use crate::fault::{JointFault, JointOf};
use crate::fixed::Fixed;
use crate::hardware::CLOCK_HZ;
use crate::images::OtherImages;
use crate::scenario::{Event, Forecast, Scenario};
use crate::shape::Shape;
use crate::terrain::{Load, Terrain};
use crate::wiring::{Face, Wiring};

/// An error in a robot file: where it is, and what to do.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct FileError(String);

/// A robot file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    modules: Spanned<usize>,
    shape: Option<Spanned<Shape>>,
    #[serde(default)]
    docks: Vec<Spanned<Fixed<Face, 2>>>,
    world: Option<Spanned<Terrain>>,
    #[serde(default)]
    image: Vec<Spanned<OtherImages>>,
    #[serde(default)]
    event: Vec<Spanned<EventTable>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EventTable {
    at: f64,
    attach: Option<Fixed<Face, 2>>,
    detach: Option<Face>,
    swap: Option<Fixed<usize, 2>>,
    reset: Option<usize>,
    mcu: Option<Mcus>,
    kill: Option<usize>,
    loss: Option<f64>,
    noise: Option<f64>,
    from: Option<Face>,
    obstacle: Option<Face>,
    clear: Option<Face>,
    shared_light: Option<bool>,
    roll: Option<f64>,
    push: Option<usize>,
    newtons: Option<Fixed<f64, 3>>,
    slip: Option<usize>,
    degrees: Option<Fixed<f64, 3>>,
    joint: Option<JointOf>,
    fault: Option<JointFault>,
    command: Option<Vec<u8>>,
    to: Option<Face>,
    console: Option<Face>,
}

/// More modules than a robot file may ask for.
const TOO_MANY_MODULES: usize = 1_000_001;

/// No potentiometer slips further at once, in degrees: beyond that its readings end before the joint does.
const FARTHEST_SLIP: f64 = 15.0;

/// The latest time of an event, in seconds: a day.
const LATEST: f64 = 86_400.0;

/// No push is stronger along an axis, in N: ten times a module's weight. Pushes of 150 N along each axis turn
/// the joints of two modules faster than a world allows.
const STRONGEST: f64 = 100.0;

impl Scenario {
    /// The robot in `text`, in TOML.
    ///
    /// # Errors
    /// The text is no TOML, has unknown fields or values out of range, or asks for what can't be. The error
    /// shows the line.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let file: File = toml::from_str(text).map_err(|error| {
            let message = in_plain_words(error.message());
            FileError(error.span().map_or(message.clone(), |span| point_at(text, span, &message)))
        })?;
        let at =
            |span: Range<usize>, message: &dyn std::fmt::Display| FileError(point_at(text, span, message));
        let wiring = file.wiring().map_err(|(span, message)| at(span, &message))?;
        let terrain = file.terrain().map_err(|(span, message)| at(span, &message))?;
        let images = file.images(&wiring).map_err(|(span, message)| at(span, &message))?;
        let mut events = Vec::new();
        for table in file.event {
            let span = table.span();
            let table = table.into_inner();
            let event = table.event().map_err(|message| at(span.clone(), &message))?;
            events.push((span, event));
        }
        events.sort_by_key(|(_, event)| event.at);
        let mut forecast = Forecast::new(&wiring);
        for (span, event) in &events {
            forecast.take(&event.change).map_err(|error| at(span.clone(), &error))?;
        }
        let timeline = events.into_iter().map(|(_, event)| event).collect();
        Ok(Scenario { wiring, terrain, images, timeline, file: text.to_owned() })
    }
}

impl File {
    fn wiring(&self) -> Result<Wiring, (Range<usize>, String)> {
        let modules = *self.modules.get_ref();
        if !(1..TOO_MANY_MODULES).contains(&modules) {
            return Err((self.modules.span(), "give a number of modules from 1 to 1000000".into()));
        }
        let mut wiring = match &self.shape {
            None => Wiring::new(modules),
            Some(shape) => {
                let wiring = shape.get_ref().wiring(modules);
                wiring.map_err(|error| (self.modules.span(), error.to_string()))?
            }
        };
        for docks in &self.docks {
            let &Fixed([one, other]) = docks.get_ref();
            wiring.attach(one, other).map_err(|error| (docks.span(), error.to_string()))?;
        }
        Ok(wiring)
    }

    fn terrain(&self) -> Result<Option<Terrain>, (Range<usize>, String)> {
        let Some(world) = &self.world else { return Ok(None) };
        let modules = *self.modules.get_ref();
        match world.get_ref().loads.iter().find(|load| load.module >= modules) {
            Some(Load { module, .. }) => Err((
                world.span(),
                format!("there is no module {module} to load: the robot has {modules}, counted from 0"),
            )),
            None => Ok(Some(world.get_ref().clone())),
        }
    }

    fn images(&self, wiring: &Wiring) -> Result<Vec<OtherImages>, (Range<usize>, String)> {
        let mut flashed = BTreeSet::new();
        for images in &self.image {
            images.get_ref().check(wiring, &mut flashed).map_err(|message| (images.span(), message))?;
        }
        Ok(self.image.iter().map(|images| images.get_ref().clone()).collect())
    }
}

impl Change {
    /// The change that the lines of an event name, in TOML, all but its time: as in `detach = "2.Back"`.
    ///
    /// # Errors
    /// They name none, or one out of range.
    pub fn from_toml(lines: &str) -> Result<Self, FileError> {
        let table = toml::from_str(&format!("at = 0\n{lines}"));
        let table: EventTable = table.map_err(|error| FileError(in_plain_words(error.message())))?;
        table.change().map_err(FileError)
    }

    /// The lines that name it in a robot file, from which [`from_toml`](Self::from_toml) makes it again.
    fn to_toml(&self) -> String {
        let from = |links: &Links| match links {
            Links::All => String::new(),
            Links::From(face) => format!("\nfrom = \"{face}\""),
        };
        match self {
            Change::Attach(one, other) => format!("attach = [\"{one}\", \"{other}\"]"),
            Change::Detach(face) => format!("detach = \"{face}\""),
            Change::Swap(one, other) => format!("swap = [{one}, {other}]"),
            Change::Reset { module, mcus } => {
                format!("reset = {module}\nmcu = \"{}\"", format!("{mcus:?}").to_lowercase())
            }
            Change::Kill(module) => format!("kill = {module}"),
            Change::Loss { links, probability } => format!("loss = {probability:?}{}", from(links)),
            Change::Noise { links, probability } => format!("noise = {probability:?}{}", from(links)),
            Change::Obstacle { at, is_there: true } => format!("obstacle = \"{at}\""),
            Change::Obstacle { at, is_there: false } => format!("clear = \"{at}\""),
            Change::SharedLight(is_shared) => format!("shared_light = {is_shared}"),
            Change::Roll(degrees) => format!("roll = {degrees:?}"),
            Change::Push { module, newtons } => format!("push = {module}\nnewtons = {newtons:?}"),
            Change::Slip { module, degrees } => format!("slip = {module}\ndegrees = {degrees:?}"),
            Change::Fault { joint, fault } => {
                format!("joint = \"{joint}\"\nfault = \"{}\"", format!("{fault:?}").to_lowercase())
            }
            Change::Command { at, payload } => format!("command = {payload:?}\nto = \"{at}\""),
            Change::Console(at) => format!("console = \"{at}\""),
        }
    }
}

impl Event {
    /// Its table in a robot file.
    pub fn to_toml(&self) -> String {
        format!("[[event]]\nat = {:?}\n{}\n", self.seconds(), self.change.to_toml())
    }
}

impl EventTable {
    fn event(self) -> Result<Event, String> {
        if !(0.0..=LATEST).contains(&self.at) {
            return Err("give `at` in seconds from 0 to 86400".into());
        }
        let at = (self.at * f64::from(CLOCK_HZ)).round() as u64;
        Ok(Event { at, change: self.change()? })
    }

    /// The one change that the table names.
    fn change(self) -> Result<Change, String> {
        if self.mcu.is_some() && self.reset.is_none() {
            return Err("`mcu` belongs to `reset`".into());
        }
        if self.from.is_some() && self.loss.is_none() && self.noise.is_none() {
            return Err("`from` belongs to `loss` or `noise`".into());
        }
        if self.to.is_some() != self.command.is_some() {
            return Err(
                "give both `command`, the bytes of a message to HORMONE, and `to`, a free dock".into()
            );
        }
        if self.push.is_some() != self.newtons.is_some() {
            return Err("give both `push`, a module, and `newtons`, as in [0, 20, 0]".into());
        }
        if self.slip.is_some() != self.degrees.is_some() {
            return Err("give both `slip`, a module, and `degrees`, as in [1.5, 0, -2]".into());
        }
        if self.joint.is_some() != self.fault.is_some() {
            return Err("give both `joint`, as in \"1.Motor0\", and its `fault`".into());
        }
        let links = self.from.map_or(Links::All, Links::From);
        let changes = [
            self.attach.map(|Fixed([one, other])| Ok(Change::Attach(one, other))),
            self.detach.map(|face| Ok(Change::Detach(face))),
            self.swap.map(|Fixed([one, other])| Ok(Change::Swap(one, other))),
            self.reset.map(|module| Ok(Change::Reset { module, mcus: self.mcu.unwrap_or(Mcus::Both) })),
            self.kill.map(|module| Ok(Change::Kill(module))),
            self.loss.map(|chance| Ok(Change::Loss { links, probability: probability(chance)? })),
            self.noise.map(|chance| Ok(Change::Noise { links, probability: probability(chance)? })),
            self.obstacle.map(|at| Ok(Change::Obstacle { at, is_there: true })),
            self.clear.map(|at| Ok(Change::Obstacle { at, is_there: false })),
            self.shared_light.map(|is_shared| Ok(Change::SharedLight(is_shared))),
            self.roll.map(|degrees| Ok(Change::Roll(roll(degrees)?))),
            self.push.zip(self.newtons).map(|(module, Fixed(newtons))| push(module, newtons)),
            self.slip.zip(self.degrees).map(|(module, Fixed(degrees))| slip(module, degrees)),
            self.joint.zip(self.fault).map(|(joint, fault)| Ok(Change::Fault { joint, fault })),
            self.command.zip(self.to).map(|(payload, at)| command(payload, at)),
            self.console.map(|at| Ok(Change::Console(at))),
        ];
        let mut changes = changes.into_iter().flatten();
        match (changes.next(), changes.next()) {
            (Some(change), None) => change,
            _ => Err("give one of attach, detach, swap, reset, kill, loss, noise, obstacle, clear, \
                      shared_light, roll, push, slip, joint, command and console"
                .into()),
        }
    }
}

fn probability(value: f64) -> Result<f64, String> {
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err("give a probability from 0 to 1".into()) }
}

fn roll(degrees: f64) -> Result<f64, String> {
    if (-180.0..=180.0).contains(&degrees) {
        Ok(degrees)
    } else {
        Err("give `roll` in degrees from -180 to 180".into())
    }
}

fn push(module: usize, newtons: [f64; 3]) -> Result<Change, String> {
    if newtons.iter().all(|force| force.abs() <= STRONGEST) {
        Ok(Change::Push { module, newtons })
    } else {
        Err("give `newtons` from -100 to 100".into())
    }
}

fn slip(module: usize, degrees: [f64; 3]) -> Result<Change, String> {
    if degrees.iter().all(|slip| slip.abs() <= FARTHEST_SLIP) {
        Ok(Change::Slip { module, degrees })
    } else {
        Err("give `degrees` from -15 to 15".into())
    }
}

fn command(payload: Vec<u8>, at: Face) -> Result<Change, String> {
    if payload.len() > MAX_PAYLOAD {
        return Err(format!("give a command of at most {MAX_PAYLOAD} bytes"));
    }
    // Anything else may be sent, to see what a robot makes of it; a mistake in an order would go unnoticed.
    let advice = match payload.first().map(|first| first >> 4) {
        Some(0xd) => "give an order as 0xd0 + gait, a number, and a Period: 5 to 80 times 50 ms, or 255",
        Some(0xe) => "give a course as 0xe0 + 0, 1 or 2, a number, and for how many modules, from 1",
        _ => return Ok(Change::Command { at, payload }),
    };
    if Hormone::from_payload(&payload).is_none() {
        return Err(advice.into());
    }
    Ok(Change::Command { at, payload })
}

/// A message of the TOML reader without the names of Rust's types.
fn in_plain_words(message: &str) -> String {
    const WORDS: [(&str, &str); 7] = [
        ("expected usize", "give a whole number from 0"),
        ("expected u8", "give a whole number from 0 to 255"),
        ("expected f64", "give a number"),
        ("expected a string", "give a text in quotes"),
        ("wanted string or table", "give a text in quotes"),
        ("expected a sequence", "give a list, as in [1, 2]"),
        ("invalid type: map, give a list, as in [1, 2]", "one table in [ ]: give a list of tables, in [[ ]]"),
    ];
    let message = message.trim_end();
    match message.split_once("expected struct ") {
        Some((before, _)) => format!("{before}give a table, as docs/simulator.md has it"),
        None => WORDS.iter().fold(message.to_owned(), |message, (from, to)| message.replace(from, to)),
    }
}

/// The message, and below it the first line of `span` with its number.
fn point_at(text: &str, span: Range<usize>, message: &dyn std::fmt::Display) -> String {
    let before = &text[..span.start];
    let number = before.matches('\n').count() + 1;
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = text[start..].lines().next().unwrap_or("");
    let width = span.len().min(line.len().saturating_sub(span.start - start)).max(1);
    let margin = " ".repeat(number.to_string().len());
    let indent = " ".repeat(text[start..span.start].chars().count());
    format!(
        "line {number}: {message}\n{margin} |\n{number} | {line}\n{margin} | {indent}{}",
        "^".repeat(width)
    )
}

impl<'de> Deserialize<'de> for Face {
    /// From text as in `"3.Left"`.
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let face = named(&text, Dock::ALL.map(|dock| (format!("{dock:?}"), dock)));
        face.map(|(module, dock)| Face { module, dock }).ok_or_else(|| {
            serde::de::Error::custom(format!(
                "\"{text}\" is not a dock: write the module's number, a dot, and Front, Back, Left, Right, \
                 Up or Down"
            ))
        })
    }
}

impl<'de> Deserialize<'de> for JointOf {
    /// From text as in `"3.Motor1"`.
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let joint = named(&text, Axis::ALL.map(|axis| (format!("Motor{}", axis.index()), axis)));
        joint.map(|(module, axis)| JointOf { module, axis }).ok_or_else(|| {
            serde::de::Error::custom(format!(
                "\"{text}\" is not a joint: write the module's number, a dot, and Motor0, Motor1 or Motor2"
            ))
        })
    }
}

/// The module, and which of its parts, that text as in `"3.Left"` names, in capitals or not.
fn named<T>(text: &str, parts: impl IntoIterator<Item = (String, T)>) -> Option<(usize, T)> {
    let (module, name) = text.split_once('.')?;
    let (_, part) = parts.into_iter().find(|(known, _)| known.eq_ignore_ascii_case(name))?;
    Some((module.parse().ok()?, part))
}
