//! Runs both engines on random robots and timelines. They must agree in types and verdict at the end, and in
//! the actions and their times up to there.
//!
//! `SUPERBOT_ROBOTS=200` tries that many; `SUPERBOT_ROBOT=7` tries the one with that seed, and prints its
//! timeline and differences.

use std::fmt::Write;

use hormone::event::Event as Did;
use hormone::gait::GaitName;
use simavr_harness::{Engine, RobotBuilder};
use simulation::{Change, Event, Face, Mcus, Native, Random, Robot, Run, Shape, Wiring, faults};
use superbot_tests_simavr::{MILLISECOND, firmware, setting};
use tasks::dock::Dock;

/// How many robots are tried, unless `SUPERBOT_ROBOTS` says otherwise.
const ROBOTS: u64 = 4;

/// Events happen to robots within this time. Their actions are compared from `SETTLED` to `END`.
const HAPPENS: std::ops::Range<u64> = 2_000 * MILLISECOND..4_000 * MILLISECOND;
const SETTLED: u64 = 8_000 * MILLISECOND;
const END: u64 = 10_400 * MILLISECOND;

/// Modules get their power within this time, in both engines at the same moments.
const POWER_UP_WITHIN: u64 = 40 * MILLISECOND;

/// How far apart in time the engines may begin a module's action.
const APART: u64 = 150 * MILLISECOND;

/// The result of a run.
struct Outcome {
    /// A line for each module: whether it is on, its type, its neighbours and its gait.
    modules: Vec<String>,
    faults: Vec<String>,
    /// By module, the actions that it began after `SETTLED`, and when.
    actions: Vec<Vec<(String, u64)>>,
}

fn outcome(robot: impl Robot, timeline: Vec<Event>) -> Outcome {
    let mut run = Run::new(robot, timeline, 1_000 * MILLISECOND);
    run.record(END);
    while run.step(END).expect("the timeline is possible") {}
    let recording = run.finish_recording().expect("it was asked for");
    let count = recording.modules;
    let describe = |module| {
        let status = run.robot.status(module).filter(|_| run.robot.is_on(module));
        format!("{:?}", status.map(|status| (status.module_type, status.neighbours(), status.gait)))
    };
    let mut actions = vec![Vec::new(); count];
    for trace_event in recording.trace_events.iter().filter(|trace_event| trace_event.cycle >= SETTLED) {
        if let Did::ActionBegun(action) = trace_event.event {
            actions[trace_event.module].push((format!("{action:?}"), trace_event.cycle));
        }
    }
    Outcome { modules: (0..count).map(describe).collect(), faults: faults(&run, true), actions }
}

/// A random source for picking.
struct Pick(Random);

impl Pick {
    fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    fn of<T: Copy>(&mut self, what: &[T]) -> T {
        what[self.below(what.len())]
    }

    fn face(&mut self, wiring: &Wiring) -> Face {
        Face { module: self.below(wiring.modules()), dock: self.of(&Dock::ALL) }
    }

    fn wiring(&mut self) -> Wiring {
        let shaped = [
            (Shape::Centipede, 1..13),
            (Shape::Chain, 2..9),
            (Shape::Ring, 3..9),
            (Shape::FourLegs, 8..11),
            (Shape::SixLegs, 11..12),
            (Shape::Cross, 5..10),
            (Shape::Human, 6..9),
        ];
        let which = self.below(shaped.len() + 1);
        let Some((shape, modules)) = shaped.get(which) else { return self.tree() };
        let modules = modules.start + self.below(modules.len());
        shape.wiring(modules).expect("the shape has so many modules")
    }

    /// A tree: each module is attached to an earlier one, at any dock of that.
    fn tree(&mut self) -> Wiring {
        let mut wiring = Wiring::new(2 + self.below(8));
        for module in 1..wiring.modules() {
            loop {
                let face = Face { module: self.below(module), dock: self.of(&Dock::ALL) };
                let own = Face { module, dock: self.of(&[Dock::Front, Dock::Back]) };
                if wiring.attach(face, own).is_ok() {
                    break;
                }
            }
        }
        wiring
    }

    /// Up to three changes, each possible after the ones before.
    fn timeline(&mut self, mut wiring: Wiring) -> Vec<Event> {
        let mut moments: Vec<u64> = (0..self.below(4)).map(|_| self.moment()).collect();
        moments.sort_unstable();
        let mut loose: Option<(Face, Face)> = None;
        let mut timeline = Vec::new();
        for at in moments {
            let face = self.face(&wiring);
            let change = match (self.below(7), loose.take()) {
                (0..4, Some((one, other))) => Change::Attach(one, other),
                (0, _) => Change::Reset {
                    module: face.module,
                    mcus: self.of(&[Mcus::Master, Mcus::Slave, Mcus::Both]),
                },
                (1 | 2, _) => {
                    loose = wiring.peer(face).map(|peer| (face, peer));
                    Change::Detach(face)
                }
                (3, _) => Change::Swap(face.module, self.below(wiring.modules())),
                (4, _) => Change::Kill(face.module),
                (5, _) => Change::Roll(self.of(&[180.0, 90.0, 0.0])),
                _ => {
                    let gaits = [
                        GaitName::Centipede,
                        GaitName::Caterpillar,
                        GaitName::Serpentine,
                        GaitName::RollingTrack,
                    ];
                    let gait = self.of(&gaits) as u8;
                    Change::Command { at: face, payload: vec![0xd0 + gait, 1, self.of(&[255, 10, 30])] }
                }
            };
            if change.apply(&mut wiring).is_ok() {
                timeline.push(Event { at, change });
            }
        }
        timeline
    }

    fn moment(&mut self) -> u64 {
        HAPPENS.start + self.0.next_u64() % (HAPPENS.end - HAPPENS.start)
    }
}

/// The differences between the engines with the robot of this seed, in lines; none if they agree.
fn differences(seed: u64, tells: bool) -> String {
    let mut pick = Pick(Random::new(seed));
    let wiring = pick.wiring();
    let mut timeline = pick.timeline(wiring.clone());
    let shares_light = pick.below(2) == 0;
    timeline.insert(0, Event { at: 0, change: Change::SharedLight(shares_light) });
    let builder = RobotBuilder::wired(firmware(), &wiring).seed(seed).power_up_within(POWER_UP_WITHIN);
    let engine = Engine::new(builder.build().expect("the robot can be built"), 2);
    let simavr = outcome(engine, timeline.clone());
    let native = outcome(Native::new(wiring.clone(), seed, POWER_UP_WITHIN), timeline.clone());
    let mut lines = String::new();
    for (module, (one, other)) in simavr.modules.iter().zip(&native.modules).enumerate() {
        if one != other {
            let _ = writeln!(lines, "module {module}: {one} in simavr, {other} natively");
        }
    }
    if simavr.faults.is_empty() != native.faults.is_empty() {
        let _ = writeln!(lines, "faults: {:?} in simavr, {:?} natively", simavr.faults, native.faults);
    }
    for (module, (one, other)) in simavr.actions.iter().zip(&native.actions).enumerate() {
        for ((name, actions), others) in [(("simavr", one), other), (("native", other), one)] {
            let inner = actions.iter().filter(|(_, at)| (SETTLED + APART..END - APART).contains(at));
            for (action, at) in inner {
                let is_done = others.iter().any(|(what, when)| what == action && when.abs_diff(*at) <= APART);
                if !is_done {
                    let ms = at / MILLISECOND;
                    let _ = writeln!(lines, "module {module}: {action} at {ms} ms in {name} alone");
                }
            }
        }
    }
    if tells || !lines.is_empty() {
        let attachments: Vec<_> = wiring.attachments().collect();
        lines = format!("seed {seed}: {attachments:?}\n{timeline:#?}\n{lines}");
    }
    lines
}

#[test]
fn robots_made_up_by_chance_do_the_same_in_both_engines() {
    if let Some(seed) = setting("SUPERBOT_ROBOT") {
        return eprintln!("{}", differences(seed, true));
    }
    let different: Vec<String> = (0..setting("SUPERBOT_ROBOTS").unwrap_or(ROBOTS))
        .map(|seed| differences(seed, false))
        .filter(|lines| !lines.is_empty())
        .collect();
    assert!(different.is_empty(), "{} differ\n{}", different.len(), different.join("\n"));
}
