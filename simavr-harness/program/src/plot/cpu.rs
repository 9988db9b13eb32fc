//! Plots the shares of tasks and interrupts in the time of a module's CPUs.

use std::error::Error;
use std::path::Path;

use plotters::prelude::*;
use simavr_harness::{Controller, Engine, Holder, RobotBuilder, Slice, Terrain, Trace};
use simulation::{MILLISECOND, Robot, Shape};

use crate::arguments::CoreName;
use crate::chart::{COLOURS, FONT};
use crate::dark::for_any_page;
use crate::images::load_images;
use crate::scenario::POWER_UP_WITHIN;

const MODULES: usize = 10;

/// A module of the body with two legs.
const MODULE: usize = 5;

/// The time until which the robot rises, and the time for which it is then measured, in s.
const RISEN: u64 = 3;
const SECONDS: u64 = 5;

/// The height of a bar, the distance from one bar to the next, and the space above and below all bars, in
/// pixels.
const BAR: i32 = 14;
const STEP: i32 = 20;
const ABOVE: i32 = 34;
const BELOW: i32 = 14;

/// The left end of the bars, and the length of the longest one, in pixels.
const LEFT: i32 = 190;
const LONGEST: i32 = 440;

/// A share of an MCU's time.
struct Share {
    controller: Controller,
    name: String,
    percent: f64,
}

pub fn plot(images: &Path, threads: usize) -> Result<String, Box<dyn Error>> {
    let images = load_images(images, CoreName::Decoded)?;
    let wiring = Shape::Centipede.wiring(MODULES)?;
    let builder = RobotBuilder::wired(images, &wiring).seed(1).power_up_within(POWER_UP_WITHIN);
    let mut robot = builder.on_terrain(&Terrain::default()).build()?;
    for controller in Controller::ALL {
        robot.module_mut(MODULE).ok_or("the robot is too short")?.mcu_mut(controller).trace()?;
    }
    let mut engine = Engine::new(robot, threads);
    engine.run_until((RISEN + SECONDS) * 1000 * MILLISECOND);
    if let Some(trouble) = Robot::trouble(&engine) {
        return Err(trouble.to_string().into());
    }
    let mut all = Vec::new();
    for controller in Controller::ALL {
        let module = engine.robot_mut().module_mut(MODULE).ok_or("the robot is too short")?;
        let trace = module.mcu_mut(controller).take_trace().ok_or("the MCU was not traced")?;
        all.extend(shares(controller, &trace, RISEN * 1000 * MILLISECOND));
    }
    let mut svg = String::new();
    draw(&all, &mut svg)?;
    for_any_page(svg)
}

/// The shares of the time since `begin`: first all interrupts together, then the tasks, largest first,
/// without the time of interrupts.
fn shares(controller: Controller, trace: &Trace, begin: u64) -> Vec<Share> {
    let mut cycles = vec![0; trace.tasks.len()];
    let mut interrupts = 0;
    let outermost = outermost(&trace.interrupts);
    let mut next = outermost.iter().peekable();
    for Slice { begin: from, end, what } in &trace.cpu {
        let (from, end) = ((*from).max(begin), (*end).max(begin));
        // The cycles of interrupts in this slice.
        let mut within = 0;
        while let Some(interrupt) = next.peek() {
            let (first, last) = (interrupt.begin.max(from), interrupt.end.min(end));
            within += last.saturating_sub(first);
            if interrupt.end > end {
                break;
            }
            next.next();
        }
        interrupts += within;
        if let Holder::Task(task) = what {
            cycles[*task] += (end - from).saturating_sub(within);
        }
    }
    let percent = |cycles: u64| 100.0 * cycles as f64 / (trace.end - begin).max(1) as f64;
    let share = |name: &str, cycles| Share { controller, name: name.to_owned(), percent: percent(cycles) };
    let mut shares: Vec<Share> =
        trace.tasks.iter().zip(cycles).map(|(task, cycles)| share(&task.name, cycles)).collect();
    shares.sort_by(|one, other| other.percent.total_cmp(&one.percent));
    shares.insert(0, share("interrupts", interrupts));
    shares
}

/// The interrupts that do not interrupt another one.
fn outermost(interrupts: &[Slice<u8>]) -> Vec<&Slice<u8>> {
    let mut outermost: Vec<&Slice<u8>> = Vec::new();
    for interrupt in interrupts {
        if outermost.last().is_none_or(|last| last.end <= interrupt.begin) {
            outermost.push(interrupt);
        }
    }
    outermost
}

fn draw(shares: &[Share], svg: &mut String) -> Result<(), Box<dyn Error>> {
    let height = ABOVE + STEP * shares.len() as i32 + BELOW;
    let area = SVGBackend::with_string(svg, (720, height as u32)).into_drawing_area();
    area.fill(&WHITE)?;
    area.draw(&Text::new("% of the CPU's time", (LEFT, 10), FONT))?;
    let most = shares.iter().map(|share| share.percent).fold(f64::MIN_POSITIVE, f64::max);
    for (Share { controller, name, percent }, top) in shares.iter().zip((ABOVE..).step_by(STEP as usize)) {
        let colour = COLOURS[*controller as usize];
        let right = LEFT + (f64::from(LONGEST) * percent / most) as i32;
        area.draw(&Rectangle::new([(LEFT, top), (right, top + BAR)], colour.filled()))?;
        area.draw(&Text::new(format!("{controller:?} {name}"), (12, top), FONT))?;
        area.draw(&Text::new(format!("{percent:.2}"), (right + 6, top), FONT))?;
    }
    area.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_have_their_time_without_that_of_interrupts() {
        fn slice<T>(begin: u64, end: u64, what: T) -> Slice<T> {
            Slice { begin, end, what }
        }
        let task = |name: &str| simavr_harness::TaskTrace { name: name.into(), states: Vec::new() };
        let mut trace = Trace::default();
        trace.cpu = vec![
            slice(0, 100, Holder::Start),
            slice(100, 300, Holder::Task(0)),
            slice(300, 400, Holder::Task(1)),
            slice(400, 1100, Holder::Sleep),
        ];
        // The second lies within the first; the third goes on from one task to the next.
        trace.interrupts = vec![slice(110, 150, 1), slice(120, 140, 2), slice(280, 310, 1)];
        trace.tasks = vec![task("ONE"), task("OTHER")];
        trace.end = 1100;
        let shares = shares(Controller::Master, &trace, 100);
        let told: Vec<_> = shares.iter().map(|share| (share.name.as_str(), share.percent)).collect();
        assert_eq!(told, [("interrupts", 7.0), ("ONE", 14.0), ("OTHER", 9.0)]);
    }
}
