//! `./x sim --view`: the run as a page in a browser, which shows the run live and can intervene.
//!
//! The run advances as far as a page asks, and otherwise waits. An event that a page asks for happens between
//! two steps, at a time that a robot file can name, so that an interactive run can be repeated.

mod feed;
mod inspect;
mod server;

use std::collections::BTreeMap;
use std::error::Error;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvError};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;
use simulation::{Change, Event, Forecast, Run, Scenario, Wiring};

use super::arguments::Sim;
use super::display::Display;
use super::output::say;
use super::record::{EVERY, subject};
use super::report::Report;
use super::scenario::{cycles, expect_possible, loss};
use feed::{Feed, Stream};
pub use inspect::Inspected;
use inspect::Inspector;
use server::{Answer, Asked, Server, Wish};

/// The time for which a page may be away, to be reloaded, before the program takes it for gone.
const PATIENCE: Duration = Duration::from_secs(2);

/// A run that pages show.
pub struct View {
    feed: Arc<Feed>,
    asked: Receiver<Asked>,
    /// By page, the cycle up to which it wants the run to advance.
    until: BTreeMap<Option<Stream>, u64>,
    /// The time for which the run has waited for pages.
    waited: Duration,
    /// By page, the inspector of the module that it looks into, if any.
    inspectors: BTreeMap<Stream, Inspector>,
    /// The robot as a robot file without events, and its wiring at power-up.
    robot: String,
    wiring: Wiring,
}

impl View {
    /// Begins to serve the page, and prints its address.
    ///
    /// # Errors
    /// The page can't be served.
    pub fn of(options: &Sim, scenario: &Scenario) -> Result<Option<Self>, Box<dyn Error>> {
        let Some(port) = options.view else { return Ok(None) };
        let modules = scenario.wiring.modules();
        let page = viewer::live_page(&subject(options, scenario), modules, EVERY)?;
        let feed = Arc::new(Feed::default());
        let (sender, asked) = mpsc::channel();
        let server = Server::new(page, port, Arc::clone(&feed), sender)?;
        let address = server.address();
        thread::spawn(move || server.serve());
        say(format_args!("superbot-sim: look at {address}\n"));
        open(&address);
        Ok(Some(View {
            feed,
            asked,
            until: BTreeMap::new(),
            waited: Duration::ZERO,
            inspectors: BTreeMap::new(),
            robot: robot(scenario)?,
            wiring: scenario.wiring.clone(),
        }))
    }

    /// Runs the robot up to `end`, as pages ask for it, and shows it on `display`, too.
    ///
    /// # Errors
    /// Memory runs out.
    pub fn drive<R: Inspected>(
        &mut self,
        options: &Sim,
        run: &mut Run<R>,
        end: u64,
        display: &mut Display,
    ) -> Result<(), Box<dyn Error>> {
        let started = Instant::now();
        run.record(EVERY);
        self.tell_news(run)?;
        let mut goes_on = true;
        while goes_on {
            let now = run.robot.now();
            let is_due = run.events_to_come().next().is_some_and(|event| event.at <= now);
            let asked = if is_due || !now.is_multiple_of(EVERY) {
                // Wishes wait while an event of the robot file is due, and while the run is between two
                // looks: its own events and the ends of steps come at other times.
                None
            } else if now < self.until() {
                self.asked.try_recv().ok()
            } else {
                Some(self.wait()?)
            };
            if let Some(Asked { wish, stream, answer }) = asked {
                // The page that asked may have gone.
                let _ = answer.send(self.grant(wish, stream, options, run, display));
                self.tell_news(run)?;
            } else {
                let next_look = (now / EVERY + 1) * EVERY;
                goes_on = match run.step_until(end, next_look) {
                    Ok(goes_on) => goes_on,
                    Err(impossible) => {
                        self.tell_said(&impossible.to_string())?;
                        true
                    }
                };
                self.tell_news(run)?;
                display.show(run, end, started.elapsed().saturating_sub(self.waited));
            }
        }
        // The rest of the recording has the hormones that are still under way: they do not arrive any more.
        let rest = run.finish_recording().map(|rest| viewer::news(&rest)).transpose()?;
        rest.into_iter().for_each(|rest| self.feed.tell(rest));
        Ok(())
    }

    /// Tells pages how the run ended, and serves them until they are gone.
    ///
    /// # Errors
    /// Memory runs out.
    pub fn end<R: Inspected>(
        self,
        report: &Report,
        options: &Sim,
        run: &Run<R>,
    ) -> Result<(), Box<dyn Error>> {
        let ended = json!({ "ended": { "summary": report.to_string(), "faults": report.faults() } });
        self.feed.tell(viewer::message(&ended, &[])?);
        let file = self.file(options, run);
        let asked = self.asked;
        thread::spawn(move || {
            for Asked { wish, answer, .. } in asked {
                let granted = match wish {
                    Wish::Timeline => Ok(file.clone()),
                    _ => Err("the run is over".into()),
                };
                // The page that asked may have gone.
                let _ = answer.send(granted);
            }
        });
        self.feed.wait_until_alone(PATIENCE);
        Ok(())
    }

    /// The robot as a robot file, with the events that have happened, and those of its own file that still
    /// can.
    fn file<R: Inspected>(&self, options: &Sim, run: &Run<R>) -> String {
        let mut forecast = Forecast::new(&self.wiring);
        // Events that options ask for are left out: the options will ask for them again.
        let of_options = loss(options);
        let events = run.happened().iter().chain(run.events_to_come());
        let events = events.filter(|event| Some(*event) != of_options.as_ref());
        let possible = events.filter(|event| forecast.take(&event.change).is_ok());
        possible.fold(self.robot.clone(), |file, event| file + "\n" + &event.to_toml())
    }

    /// The time for which the run has waited for pages.
    pub fn waited(&self) -> Duration {
        self.waited
    }

    /// The latest cycle up to which a page that still listens wants the run to advance.
    fn until(&mut self) -> u64 {
        self.until.retain(|stream, _| stream.is_none_or(|stream| self.feed.has(stream)));
        self.until.values().copied().max().unwrap_or(0)
    }

    fn wait(&mut self) -> Result<Asked, RecvError> {
        let since = Instant::now();
        let asked = self.asked.recv();
        self.waited += since.elapsed();
        asked
    }

    fn grant<R: Inspected>(
        &mut self,
        wish: Wish,
        stream: Option<Stream>,
        options: &Sim,
        run: &mut Run<R>,
        display: &mut Display,
    ) -> Answer {
        match wish {
            Wish::Until(seconds) => {
                self.until.insert(stream, cycles(seconds));
                Ok(String::new())
            }
            Wish::Event(lines) => {
                let change = Change::from_toml(&lines).map_err(|error| error.to_string())?;
                expect_possible(options, &change)?;
                run.happen(change.clone()).map_err(|error| error.to_string())?;
                // This message stays visible: the next picture is drawn below it.
                display.finish();
                say(format_args!("\n{}", Event { at: run.robot.now(), change }.to_toml()));
                Ok(String::new())
            }
            Wish::Inspect(module) => {
                let modules = run.robot.wiring().modules();
                match module.filter(|&module| module >= modules) {
                    Some(module) => {
                        Err(format!("there is no module {module}: the robot has {modules}, counted from 0"))
                    }
                    None => {
                        // Without a stream no page could get the data.
                        if let Some(stream) = stream {
                            self.inspectors.remove(&stream);
                            self.inspectors.extend(module.map(|module| (stream, Inspector::of(module))));
                        }
                        Ok(String::new())
                    }
                }
            }
            Wish::Timeline => Ok(self.file(options, run)),
        }
    }

    fn tell_news<R: Inspected>(&mut self, run: &mut Run<R>) -> Result<(), Box<dyn Error>> {
        let now = run.robot.now();
        if let Some(recorder) = &mut run.observer.recorder {
            let news = recorder.news(now);
            if !news.is_empty() {
                self.feed.tell(viewer::news(&news)?);
            }
        }
        self.inspectors.retain(|&stream, _| self.feed.has(stream));
        for (&stream, inspector) in &mut self.inspectors {
            let inside = inspector.look(&run.robot);
            self.feed.tell_for_now(stream, viewer::message(&json!({ "module": inside }), &[])?);
        }
        Ok(())
    }

    fn tell_said(&self, text: &str) -> Result<(), Box<dyn Error>> {
        say(format_args!("superbot-sim: {text}\n"));
        self.feed.tell(viewer::message(&json!({ "said": text }), &[])?);
        Ok(())
    }
}

/// The robot as a robot file without events.
fn robot(scenario: &Scenario) -> Result<String, Box<dyn Error>> {
    let mut robot: toml::Table = toml::from_str(&scenario.file)?;
    robot.remove("event");
    let robot = toml::to_string(&robot)?;
    let arguments: Vec<_> = std::env::args_os().skip(2).collect();
    let arguments: Vec<_> = arguments.iter().map(|argument| quoted(&argument.to_string_lossy())).collect();
    Ok(format!("# Saved from ./x sim {}\n{robot}", arguments.join(" ")))
}

/// An argument quoted for a shell, on one line and without characters that a comment of TOML may not have.
fn quoted(argument: &str) -> String {
    match shlex::try_quote(argument) {
        Ok(quoted) if !argument.contains(|letter: char| letter.is_ascii_control()) => quoted.into(),
        _ => {
            let escaped = argument.chars().map(|letter| match letter {
                '\'' | '\\' => format!("\\{letter}"),
                _ if letter.is_ascii_control() => format!("\\x{:02x}", u32::from(letter)),
                _ => letter.into(),
            });
            format!("$'{}'", escaped.collect::<String>())
        }
    }
}

/// Opens the page in a browser, if there is a desktop.
fn open(address: &str) {
    let is_desktop = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    if is_desktop {
        // If this fails, the user opens the page by hand.
        let quiet = || Stdio::null();
        let _ = Command::new("xdg-open").arg(address).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn();
    }
}
