//! The robot as it runs: a progress line, and a line for each module.

use std::io::{self, IsTerminal};
use std::time::Duration;

use simulation::{CLOCK_HZ, Robot, Run};

use super::output::say;

/// The most modules that get a line each; of a longer robot the first are shown.
const LINES: usize = 20;

/// How often a display that is no terminal gets a progress line, in simulated seconds.
const PROGRESS: f64 = 1.0;

/// A picture of the robot on the standard error, drawn over itself on a terminal.
pub struct Display {
    is_on: bool,
    is_terminal: bool,
    lines: usize,
    next_progress: f64,
}

impl Display {
    pub fn new(is_on: bool) -> Self {
        Display { is_on, is_terminal: io::stderr().is_terminal(), lines: 0, next_progress: PROGRESS }
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
        if self.is_terminal {
            self.draw(robot, &progress);
        } else if seconds(now) >= self.next_progress || now == end {
            self.next_progress = seconds(now) + PROGRESS;
            say(format_args!("{progress}\n"));
        }
    }

    /// Leaves the last picture where it stands.
    pub fn finish(&mut self) {
        self.lines = 0;
    }

    fn draw(&mut self, robot: &impl Robot, progress: &str) {
        let mut picture = String::new();
        if self.lines > 0 {
            picture += &format!("\x1b[{}A", self.lines); // back to the first line
        }
        picture +=
            &format!("{progress}\x1b[K\n module  type      hormone  action    topology changes\x1b[K\n");
        let modules = robot.wiring().modules();
        let shown = modules.min(LINES);
        for module in 0..shown {
            picture += &line(robot, module);
        }
        self.lines = shown + 2;
        if shown < modules {
            picture += &format!("    ... {} more\x1b[K\n", modules - shown);
            self.lines += 1;
        }
        say(picture);
    }
}

fn line(robot: &impl Robot, module: usize) -> String {
    let Some(status) = robot.status(module) else {
        return format!("{module:7}  (starting)\x1b[K\n");
    };
    let hormone = status.hormone().map_or("-".into(), |data| format!("{data:?}"));
    let mark = if robot.is_right(module) { ' ' } else { '?' };
    format!(
        "{module:7}{mark} {:9} {hormone:8} {:9} {}\x1b[K\n",
        format!("{:?}", status.module_type),
        format!("{:?}", status.action),
        status.topology_changes
    )
}
