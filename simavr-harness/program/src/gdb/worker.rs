//! Runs the robot, and holds it up where gdb wants its MCU.
//!
//! Moments are told apart by the MCU's cycle before an instruction. To go back, what lies between a copy in
//! the [`History`] and now is run again to find the last moment at which gdb wants to stop, and then up to
//! that.

use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use simavr_harness::{Debugger, Mcu, Tasks};

use super::super::output::say;
use super::history::{History, Wake};
use super::order::{Line, Order, Picture, Points, Reason, Report, Watched, Watchpoint, Way};
use super::process;

/// Once in so many instructions the server is asked whether it wants anything.
const PATIENCE: u32 = 1 << 14;

/// Who holds the robot up.
pub struct Worker {
    server: Line,
    tasks: Option<Tasks>,
    history: History,
    goal: Goal,
    points: Points,
    /// The instruction before.
    last: Option<Moment>,
    /// Instructions since the server was asked.
    unasked: u32,
}

/// What the run is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Goal {
    /// To come to where gdb wants to stop, or one instruction further.
    Forward { is_step: bool },
    /// To come to the first instruction at or after a cycle, and stop there for this reason.
    Reach { cycle: u64, reason: Reason },
    /// To find the last moment before a cycle at which gdb wants to stop: at any instruction, for a step.
    /// What lies behind the copy of this number is looked through.
    Search { until: u64, is_step: bool, behind: usize, found: Option<(u64, Reason)> },
}

/// The moment before an instruction.
struct Moment {
    cycle: u64,
    /// What is watched for changes.
    watched: Vec<u8>,
    /// What the instruction reads of what is watched for that.
    read: Option<Reason>,
}

/// A worker that both the MCU and the run know.
#[derive(Clone)]
pub struct Shared(Arc<Mutex<Worker>>);

impl Debugger for Shared {
    fn before_instruction(&mut self, mcu: &mut Mcu) {
        self.with(|worker| worker.look(mcu));
    }
}

impl Shared {
    pub fn with<R>(&self, act: impl FnOnce(&mut Worker) -> R) -> R {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The worker of an MCU that has not run yet. It goes up to cycle `at` first.
    pub fn new(server: Line, mcu: &Mcu, at: u64) -> Self {
        Shared(Arc::new(Mutex::new(Worker {
            server,
            tasks: Tasks::of(mcu).ok(),
            history: History::default(),
            goal: Goal::Reach { cycle: at, reason: Reason::Halt },
            points: Points::default(),
            last: None,
            unasked: 0,
        })))
    }
}

impl Worker {
    /// The MCU is about to execute an instruction.
    fn look(&mut self, mcu: &mut Mcu) {
        let now = mcu.cycle();
        if self.history.is_due(now) {
            self.leave_copy(now);
        }
        loop {
            self.judge(mcu);
            // What gdb has written is not lost on the way back.
            if self.history.len() > 0 || !self.leave_copy(now) {
                break;
            }
        }
        self.unasked += 1;
        if self.unasked >= PATIENCE {
            self.ask(mcu);
        }
        self.remember(mcu);
    }

    /// Stops here if that is the goal.
    fn judge(&mut self, mcu: &mut Mcu) {
        let now = mcu.cycle();
        let touched = self.touched(mcu);
        let at_breakpoint = self.points.breakpoints.contains(&mcu.pc());
        match &mut self.goal {
            Goal::Forward { is_step } => {
                let reason = match touched {
                    Some((_, reason)) => Some(reason),
                    None if at_breakpoint => Some(Reason::Breakpoint),
                    None => is_step.then_some(Reason::Step),
                };
                if let Some(reason) = reason {
                    self.stop(mcu, reason);
                }
            }
            &mut Goal::Reach { cycle, reason } => {
                if now >= cycle {
                    self.stop(mcu, reason);
                }
            }
            Goal::Search { until, is_step, found, .. } => {
                if touched.is_some() {
                    *found = touched;
                }
                if now >= *until {
                    self.conclude();
                } else if at_breakpoint {
                    *found = Some((now, Reason::Breakpoint));
                } else if *is_step {
                    *found = Some((now, Reason::Step));
                }
            }
        }
    }

    /// Stops where the server wants it, or where it is gone ends. To be called now and then, as an MCU may
    /// sleep for long.
    pub fn ask(&mut self, mcu: &mut Mcu) {
        self.unasked = 0;
        if !self.server.is_ready() {
            return;
        }
        match self.server.receive() {
            Some(Order::Interrupt) => self.stop(mcu, Reason::Halt),
            // Nothing else is said while the robot runs.
            Some(_) => {}
            None => process::leave(),
        }
    }

    /// The run is over, which `text` tells. It returns never: what comes then is to go back, or to end.
    pub fn end(&mut self, mcu: &mut Mcu, text: &str) -> ! {
        loop {
            let touched = self.touched(mcu);
            if let Goal::Search { found, .. } = &mut self.goal {
                if touched.is_some() {
                    *found = touched;
                }
                self.conclude();
            }
            say(text);
            let reason = match self.goal {
                // It was at the end that gdb wanted to be.
                Goal::Reach { reason, .. } => reason,
                _ => Reason::End,
            };
            self.stop(mcu, reason);
            self.last = None;
        }
    }

    /// What the instruction before has changed or read of what is watched, and when it began.
    fn touched(&self, mcu: &Mcu) -> Option<(u64, Reason)> {
        let last = self.last.as_ref()?;
        if self.points.watchpoints.is_empty() {
            return None;
        }
        let now = self.watched(mcu);
        let changed = now.iter().zip(&last.watched).position(|(now, before)| now != before);
        let mut first = 0;
        let reason = changed.and_then(|changed| {
            let mut of_changes = self.watched_for_changes();
            of_changes.find(|watchpoint| {
                first += usize::from(watchpoint.length);
                changed < first
            })
        });
        Some((last.cycle, reason.map(Watchpoint::reason).or(last.read)?))
    }

    fn watched_for_changes(&self) -> impl Iterator<Item = &Watchpoint> {
        self.points.watchpoints.iter().filter(|watchpoint| watchpoint.watched != Watched::Read)
    }

    /// The bytes that are watched for changes.
    fn watched(&self, mcu: &Mcu) -> Vec<u8> {
        let addresses = self
            .watched_for_changes()
            .flat_map(|watchpoint| (watchpoint.address..).take(watchpoint.length.into()));
        addresses.map(|address| mcu.read(address).unwrap_or(0)).collect()
    }

    fn remember(&mut self, mcu: &Mcu) {
        let mut moment = Moment { cycle: mcu.cycle(), watched: Vec::new(), read: None };
        if !self.points.watchpoints.is_empty() {
            moment.watched = self.watched(mcu);
            let reads = mcu.reads_next();
            let read = self.points.watchpoints.iter().find(|watchpoint| watchpoint.is_read_by(&reads));
            moment.read = read.map(Watchpoint::reason);
        }
        self.last = Some(moment);
    }

    /// The robot waits here until gdb has it go on.
    fn stop(&mut self, mcu: &mut Mcu, reason: Reason) {
        self.report(mcu, reason);
        loop {
            match self.server.receive() {
                None => process::leave(),
                Some(Order::Interrupt) => {}
                Some(Order::Write { address, bytes }) => {
                    self.history.forget();
                    for (address, byte) in (address..).zip(bytes) {
                        mcu.write(address, byte);
                    }
                }
                Some(Order::SetRegisters(registers)) => {
                    self.history.forget();
                    mcu.set_registers(&registers);
                }
                Some(Order::Go { way, points }) => {
                    self.points = points;
                    match way {
                        Way::Continue | Way::Step => {
                            self.goal = Goal::Forward { is_step: way == Way::Step };
                            self.history.plan(mcu.cycle(), None);
                            return;
                        }
                        Way::Back | Way::StepBack => {
                            let until = mcu.cycle();
                            match self.history.before(until) {
                                Some(behind) => self.search(until, way == Way::StepBack, behind),
                                None => self.report(mcu, Reason::Begin),
                            }
                        }
                    }
                }
            }
        }
    }

    fn report(&mut self, mcu: &Mcu, reason: Reason) {
        let picture = Picture::of(mcu, self.tasks.as_mut());
        if self.server.send(&Report { reason, picture }).is_err() {
            process::leave();
        }
    }

    fn search(&mut self, until: u64, is_step: bool, behind: usize) -> ! {
        let goal = Goal::Search { until, is_step, behind, found: None };
        self.history.wake(behind, goal, self.points.clone())
    }

    /// All that was to be looked through is.
    fn conclude(&mut self) {
        let Goal::Search { is_step, behind, found, .. } = self.goal else { return };
        if let Some((cycle, reason)) = found {
            // There is one: the search itself has begun behind one.
            let from = self.history.before(cycle + 1).unwrap_or(0);
            self.history.wake(from, Goal::Reach { cycle, reason }, self.points.clone());
        }
        let until = self.history.cycle(behind);
        match behind.checked_sub(1) {
            Some(before) => self.search(until, is_step, before),
            None => {
                let goal = Goal::Reach { cycle: until, reason: Reason::Begin };
                self.history.wake(0, goal, self.points.clone())
            }
        }
    }

    /// Leaves a copy of this process here. Where that is woken it goes on with another goal. Returns whether
    /// this is it.
    fn leave_copy(&mut self, now: u64) -> bool {
        let wake = self.history.leave_copy(now, &self.server);
        let is_woken = wake.is_some();
        if let Some(Wake { goal, points, .. }) = wake {
            (self.goal, self.points, self.last) = (goal, points, None);
        }
        let until = match self.goal {
            Goal::Forward { .. } => None,
            Goal::Reach { cycle, .. } => Some(cycle),
            Goal::Search { until, .. } => Some(until),
        };
        self.history.plan(now + 1, until);
        is_woken
    }
}
