//! Runs the robot, and stops it where gdb wants its MCU to stop.
//!
//! The MCU's cycle before an instruction identifies a moment. To go back, the worker runs again from a copy
//! in the [`History`] to now, to find the last moment at which gdb wants to stop. Then it runs once more, up
//! to that moment.

use std::sync::{Arc, Mutex, PoisonError};

use simavr_harness::{Debugger, Mcu, Tasks};

use super::super::output::say;
use super::goal::Goal;
use super::history::{History, Wake};
use super::order::{Line, Order, Picture, Points, Reason, Report, Watched, Watchpoint, Way};
use super::process;

/// The number of instructions between two polls of the server.
const PATIENCE: u32 = 1 << 14;

/// Runs the robot for the server, and stops it.
pub struct Worker {
    server: Line,
    tasks: Option<Tasks>,
    history: History,
    goal: Goal,
    points: Points,
    /// The instruction before.
    last: Option<Moment>,
    /// Instructions since the server was last polled.
    unasked: u32,
}

/// The moment before an instruction.
struct Moment {
    cycle: u64,
    /// The bytes that are watched for changes.
    watched: Vec<u8>,
    /// The watchpoint for reads that the instruction touches.
    read: Option<Reason>,
}

/// A worker that the MCU and the run share.
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

    /// The worker of an MCU that has not run yet. It first runs up to cycle `at`.
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
            // After gdb has written, a copy with that is left here, so that going back does not lose it.
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

    /// Stops here if the goal is reached.
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

    /// Stops if the server asks for it, and ends the process if the server is gone. Has to be called while
    /// the MCU sleeps, too, which it may do for long.
    pub fn ask(&mut self, mcu: &mut Mcu) {
        self.unasked = 0;
        if !self.server.is_ready() {
            return;
        }
        match self.server.receive() {
            Some(Order::Interrupt) => self.stop(mcu, Reason::Halt),
            // The server sends nothing else while the robot runs.
            Some(_) => {}
            None => process::leave(),
        }
    }

    /// Handles the end of the run, after which the run can only go back or end. `text` reports the end.
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
                // The end is the moment that gdb wanted to reach.
                Goal::Reach { reason, .. } => reason,
                _ => Reason::End,
            };
            self.stop(mcu, reason);
            self.last = None;
        }
    }

    /// The watchpoint that the last instruction has touched, and the cycle at which that instruction began.
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

    /// Stops the robot here until gdb resumes it.
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

    /// Ends a search: goes to the moment that was found, or else searches from the copy before.
    fn conclude(&mut self) {
        let Goal::Search { is_step, behind, found, .. } = self.goal else { return };
        if let Some((cycle, reason)) = found {
            // There is a copy before it: the search itself began after one.
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

    /// Leaves a copy of this process here. The copy continues with another goal when it is woken. Returns
    /// `true` in the woken copy.
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
