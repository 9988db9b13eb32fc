//! Measures how soon the watchdog brings an MCU back into the robot after a task hangs.

use std::ops::Range;
use std::path::Path;

use simulation::{Face, is_on_slave};
use tasks::dock::Dock;

use super::recovery::recovery;
use super::{MEASURED, SECOND, images, milliseconds};
use crate::Controller;
use crate::bench::{BenchError, unmeasurable};
use crate::counters;
use crate::engine::Engine;
use crate::image::{Image, Place, Symbol};
use crate::robot::RobotBuilder;

/// The period at which the harness checks whether a task runs, in cycles.
const LOOK: u64 = 160;

/// The docks of the module with a neighbour, and the neighbour's own docks there. They make the module a
/// branch, which keeps straight.
const NEIGHBOURS: [(Dock, Dock); 4] = [
    (Dock::Front, Dock::Back),
    (Dock::Back, Dock::Front),
    (Dock::Left, Dock::Back),
    (Dock::Right, Dock::Back),
];

/// Makes each task of both images in `directory` hang, one after the other, in a branch of a robot. Returns
/// the longest time, in ms, until the MCU had been reset and its links carried frames, all modules knew their
/// neighbours, and hormones arrived. A task that has nothing to do does not run, and so can't hang.
///
/// # Errors
/// An image is missing, no task runs, or the module does not come back or is reset for another reason.
pub fn watchdog_recovery(directory: &Path) -> Result<f64, BenchError> {
    let firmware = images(directory, "firmware-master", "firmware-slave")?;
    let stacks = [stacks(&firmware.master), stacks(&firmware.slave)];
    let mut robot = RobotBuilder::new(firmware, MEASURED + 1 + NEIGHBOURS.len()).seed(1);
    for (number, (own, theirs)) in (MEASURED + 1..).zip(NEIGHBOURS) {
        robot = robot.attach(Face { module: MEASURED, dock: own }, Face { module: number, dock: theirs });
    }
    let mut engine = Engine::new(robot.build()?, 1);
    engine.run_until(2 * SECOND);
    let mut longest = None;
    for (controller, stacks) in Controller::ALL.into_iter().zip(stacks) {
        for stack in stacks {
            if hang(&mut engine, controller, stack) {
                let resets = resets(&engine, controller);
                let recovery = recovery(&mut engine, |engine| {
                    self::resets(engine, controller) == resets + 1 && links_carry(engine, controller)
                })?;
                longest = longest.max(Some(recovery));
            }
        }
    }
    longest.map(milliseconds).ok_or_else(|| unmeasurable("firmware", "none of its tasks runs"))
}

/// The address ranges of the stacks of an image's tasks.
fn stacks(image: &Image) -> Vec<Range<u16>> {
    let stack = |(name, symbol): (&str, Symbol)| match symbol.place {
        Place::Data(start) if rustc_demangle::demangle(name).to_string().contains("::stack::") => {
            Some(start..start + symbol.size)
        }
        _ => None,
    };
    image.symbols().filter_map(stack).collect()
}

/// Makes the task on this stack hang the next time that it runs. Returns `false` if it does not run within a
/// second.
fn hang(engine: &mut Engine, controller: Controller, stack: Range<u16>) -> bool {
    let end = engine.cycle() + SECOND;
    while engine.cycle() < end {
        engine.run_until(engine.cycle() + LOOK);
        if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
            let mcu = module.mcu_mut(controller);
            if stack.contains(&mcu.stack_pointer()) && mcu.hang() {
                return true;
            }
        }
    }
    false
}

/// How often the MCU was reset.
fn resets(engine: &Engine, controller: Controller) -> u64 {
    engine.robot().module(MEASURED).map_or(0, |module| module.mcu(controller).resets())
}

/// Whether the MCU has sent frames at all docks since it started, and received some at each with a neighbour.
fn links_carry(engine: &Engine, controller: Controller) -> bool {
    let is_here = |dock: Dock| is_on_slave(dock) == (controller == Controller::Slave);
    let neighbours = NEIGHBOURS.into_iter().filter(|&(own, _)| is_here(own)).count();
    engine.robot().module(MEASURED).is_some_and(|module| {
        let links: Vec<_> = counters::links(module.mcu(controller)).collect();
        let receive = links.iter().filter(|link| link.frames_received > 0).count();
        receive >= neighbours && links.iter().all(|link| link.frames_sent > 0)
    })
}
