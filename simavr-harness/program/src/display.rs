//! Displays the robot as it runs: its progress and, on a terminal, a table of its modules.

use std::io::{self, IsTerminal};
use std::time::{Duration, Instant};

use hormone::module_type::ModuleType;
use simulation::{CLOCK_HZ, Robot, Run};
use terminal::{Style, Term, truncate_str};

use super::output::say;
use super::table::{self, Row};

/// The most lines of the table, so that earlier output stays visible.
const LINES: usize = 22;

/// Without a terminal, the interval between progress lines, in simulated seconds.
const PROGRESS: f64 = 1.0;

/// The shortest interval between two drawings on a terminal.
const DRAWN_EVERY: Duration = Duration::from_millis(100);

/// The width of the bar, in characters.
const BAR: usize = 20;

/// A picture of the robot on the standard error, drawn over itself on a terminal.
pub struct Display {
    is_on: bool,
    terminal: Option<Term>,
    /// The time of the last drawing, and the number of its lines.
    drawn: Option<(Instant, usize)>,
    next_progress: f64,
}

impl Display {
    pub fn new(is_on: bool) -> Self {
        let terminal = io::stderr().is_terminal().then(Term::stderr);
        Display { is_on, terminal, drawn: None, next_progress: PROGRESS }
    }

    pub fn show(&mut self, run: &Run<impl Robot>, end: u64, wall: Duration) {
        if !self.is_on {
            return;
        }
        let Run { robot, observer, .. } = run;
        let now = robot.now();
        let seconds = |cycles: u64| cycles as f64 / f64::from(CLOCK_HZ);
        let progress = format!(
            "{:7.2} of {:.2} s simulated in {:.1} s, {} hormones delivered",
            seconds(now),
            seconds(end),
            wall.as_secs_f64(),
            observer.hops.delivered
        );
        if let Some(terminal) = &self.terminal {
            if now < end && self.drawn.is_some_and(|(drawn, _)| drawn.elapsed() < DRAWN_EVERY) {
                return;
            }
            let (height, width) = terminal.size();
            let progress = format!("{} {}", bar(now as f64 / end as f64, wall), progress.trim_start());
            let mut lines = vec![truncate_str(&progress, width.into(), "").into_owned()];
            // A line stays free for the cursor.
            let height = usize::from(height).saturating_sub(2).min(LINES);
            let number = robot.wiring().modules();
            lines.extend(table::lay_out(number, |module| row(run, module), width.into(), height));
            let before = self.drawn.map_or(0, |(_, lines)| lines);
            draw(terminal, before, &lines);
            self.drawn = Some((Instant::now(), lines.len()));
        } else if seconds(now) >= self.next_progress || now == end {
            self.next_progress = seconds(now) + PROGRESS;
            say(format_args!("{progress}\n"));
        }
    }

    /// Keeps the last picture: the next one is drawn below it.
    pub fn finish(&mut self) {
        self.drawn = None;
    }
}

/// The progress of the run, and the time that the rest takes at the same pace.
fn bar(done: f64, wall: Duration) -> String {
    let full = (done * BAR as f64) as usize;
    let left = wall.as_secs_f64() * (1.0 / done - 1.0);
    let left = if left.is_finite() { format!("{left:.0} s left") } else { "- left".into() };
    format!("[{}{}] {:3.0} %, {left},", "=".repeat(full), " ".repeat(BAR - full), 100.0 * done)
}

/// Draws `lines` over the `before` lines that were drawn last. Ignores a terminal that is gone.
fn draw(terminal: &Term, before: usize, lines: &[String]) {
    let _ = terminal.clear_last_lines(before);
    let _ = terminal.write_line(&lines.join("\n"));
}

/// The fields of a module, as [`table::FIELDS`] lists them.
fn row(Run { robot, observer, .. }: &Run<impl Robot>, module: usize) -> Row {
    let plain = Style::new();
    let Some(status) = robot.status(module) else {
        let rest = ["(starting)", "", "", ""].map(|text| (text.into(), plain.clone().dim()));
        let [module_type, action, hormone, changes] = rest;
        return [(module.to_string(), plain), module_type, action, hormone, changes];
    };
    let is_right = robot.is_right_by(&observer.audible, module);
    let (mark, style) = if is_right { ("", plain.clone()) } else { ("?", plain.clone().red().bold()) };
    let hormone = status.hormone().map_or("-".into(), |data| format!("{data:?}"));
    [
        (format!("{module}{mark}"), style),
        (format!("{:?}", status.module_type), of_type(status.module_type)),
        (format!("{:?}", status.action), plain.clone()),
        (hormone, plain.clone()),
        (status.topology_changes.to_string(), plain),
    ]
}

/// The colours of modules on the page of a run, as far as terminals have them.
fn of_type(module_type: ModuleType) -> Style {
    let style = Style::new();
    match module_type {
        ModuleType::Head => style.red(),
        ModuleType::Tail => style.magenta(),
        ModuleType::LeftLeg => style.green(),
        ModuleType::RightLeg => style.cyan(),
        ModuleType::Spine => style.blue(),
        ModuleType::Branch => style.yellow(),
        _ => style,
    }
}
