//! Compares a kernel that plays a script with the reference: the running task and the result of each call
//! must be the same at every step.

use std::fmt;

use crate::call::{Call, Outcome};
use crate::reference::{Reference, TaskId};
use crate::setup::Setup;
use crate::step::Step;

/// A source of steps.
pub trait Script: 'static {
    /// The next step; `None` at the end.
    fn next(&mut self, reference: &Reference) -> Option<Step>;

    /// Whether the tasks come back for more after the end, when the objects are empty and the tasks have
    /// left.
    fn goes_on(&mut self) -> bool {
        false
    }
}

/// The steps in order, each with the task that ran; `None` while no task ran.
type History = Vec<(Option<TaskId>, Step)>;

/// How the kernel differed from the reference.
pub type Complaint = String;

/// A script for which the kernel differed from the reference.
pub struct Disagreement {
    setup: Setup,
    history: History,
    what: Complaint,
}

impl Disagreement {
    /// The steps up to the difference.
    pub fn steps(&self) -> impl Iterator<Item = &Step> {
        self.history.iter().map(|(_, step)| step)
    }
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  {:?}", self.setup)?;
        for (who, step) in &self.history {
            match who {
                Some(id) => writeln!(f, "  while task {id} runs: {step:?}")?,
                None => writeln!(f, "  while none runs: {step:?}")?,
            }
        }
        write!(f, "  {}", self.what)
    }
}

/// A set of states, a bit each: those that may have held where the last interrupt came inside of a call.
pub type Ways = u128;

/// A script that was played to its end.
pub struct Played {
    setup: Setup,
    history: History,
    /// How many steps came from the script.
    scripted: usize,
    /// How many calls agreed.
    pub calls: u64,
    /// The states with which everything agrees.
    pub ways: Ways,
}

impl Played {
    /// The steps played, without those that empty the objects at the end.
    pub fn steps(&self) -> impl Iterator<Item = &Step> {
        self.history.iter().map(|(_, step)| step).take(self.scripted)
    }

    /// A disagreement of a script that agrees in itself, but not with one played before.
    pub fn disagree(self, what: Complaint) -> Box<Disagreement> {
        let Played { setup, history, .. } = self;
        Box::new(Disagreement { setup, history, what })
    }
}

/// A possible state.
struct Possible {
    reference: Reference,
    ways: Ways,
}

/// A script in progress, with the states that are possible.
pub struct Referee<S> {
    /// The possible states: one, unless an interrupt has come inside of a call. Then there are several until
    /// the outcome decides which came first.
    possible: Vec<Possible>,
    setup: Setup,
    script: S,
    is_over: bool,
    history: History,
    /// How many steps came from the script.
    scripted: usize,
    calls: u64,
}

impl<S: Script> Referee<S> {
    /// A referee at the start of a kernel with the objects of `setup`.
    pub fn new(setup: &Setup, script: S) -> Self {
        Referee {
            possible: vec![Possible { reference: Reference::new(setup), ways: 1 }],
            setup: setup.clone(),
            script,
            is_over: false,
            history: Vec::new(),
            scripted: 0,
            calls: 0,
        }
    }

    /// Returns the script, and what was played or how it disagreed.
    pub fn finish(self, result: Result<(), Complaint>) -> (S, Result<Played, Box<Disagreement>>) {
        let Referee { possible, setup, script, history, scripted, calls, .. } = self;
        let result = match result {
            Ok(()) => Ok(Played {
                setup,
                history,
                scripted,
                calls,
                ways: possible.iter().fold(0, |all, possible| all | possible.ways),
            }),
            Err(what) => Err(Box::new(Disagreement { setup, history, what })),
        };
        (script, result)
    }

    /// Whether a task may run, according to the reference.
    pub fn may_run(&self) -> bool {
        self.possible.iter().any(|possible| possible.reference.running().is_some())
    }

    /// The next step of the running task, or of the idle MCU: from the script, and after its end a step that
    /// empties an object or ends a wait.
    ///
    /// # Errors
    /// Another task should run.
    pub fn next(&mut self, who: Option<TaskId>) -> Result<Option<Step>, Complaint> {
        self.expect_running(who)?;
        let step = self.step(who);
        if let Some(step) = &step {
            self.history.push((who, step.clone()));
        }
        if let Some(Step::Call(call, _)) = step {
            self.each(|reference| reference.call(call));
        }
        Ok(step)
    }

    fn step(&mut self, who: Option<TaskId>) -> Option<Step> {
        let reference = &self.possible[0].reference;
        let step = if self.is_over { None } else { self.script.next(reference) };
        self.is_over = step.is_none();
        self.scripted += usize::from(step.is_some());
        step.or_else(|| match who {
            Some(_) => reference.way_out().map(|call| Step::Call(call, None)),
            None => reference.leftover(),
        })
    }

    /// A call before the kernel runs has returned.
    ///
    /// # Errors
    /// It should have returned something else.
    pub fn booted(&mut self, call: Call, outcome: Outcome) -> Result<(), Complaint> {
        self.keep(|reference| match reference.call_of_boot(call) {
            expected if expected == outcome => Ok(()),
            expected => {
                Err(format!("{call:?} returns {outcome:?} at the start, but should return {expected:?}"))
            }
        })
    }

    /// A task's call has returned.
    ///
    /// # Errors
    /// Another task should run, or the call should have returned something else.
    pub fn returned(&mut self, id: TaskId, outcome: Outcome) -> Result<(), Complaint> {
        self.calls += 1;
        self.expect_running(Some(id))?;
        self.keep(|reference| match reference.returned() {
            Some(expected) if expected == outcome => Ok(()),
            expected => Err(format!("task {id} is told {outcome:?}, but it should be {expected:?}")),
        })
    }

    /// The calls of an interrupt's handler have returned.
    ///
    /// # Errors
    /// They should have returned something else.
    pub fn handled(&mut self, calls: &[Call], outcomes: &[Outcome]) -> Result<(), Complaint> {
        self.calls += outcomes.len() as u64;
        self.keep(|reference| match reference.interrupt(calls) {
            expected if expected == outcomes => Ok(()),
            expected => Err(format!("the handler is told {outcomes:?}, but it should be {expected:?}")),
        })
    }

    /// Completes the running task's actions in the reference.
    ///
    /// # Errors
    /// Another task than `who` runs then.
    pub fn expect_running(&mut self, who: Option<TaskId>) -> Result<(), Complaint> {
        self.each(Reference::settle);
        self.keep(|reference| match reference.running() {
            expected if expected == who => Ok(()),
            expected => Err(format!("{} runs, but {} should", name(who), name(expected))),
        })
    }

    /// Replaces each possible state by the states in which an interrupt that is about to be handled may find
    /// it.
    ///
    /// # Errors
    /// There is no such state.
    pub fn branch(&mut self, ways: impl Fn(&Reference) -> Vec<Reference>) -> Result<(), Complaint> {
        let numbered = |possible: &Possible| {
            let ways = ways(&possible.reference);
            let is_at_rest = ways.len() == 1;
            // If there are more states than bits, the rest share the last bit.
            let number = |(number, reference): (usize, _)| Possible {
                reference,
                ways: if is_at_rest { possible.ways } else { 1 << number.min(127) },
            };
            ways.into_iter().enumerate().map(number).collect::<Vec<_>>()
        };
        self.possible = self.possible.iter().flat_map(numbered).collect();
        if self.possible.is_empty() {
            return Err("another task should be interrupted".to_string());
        }
        self.forget_equals();
        Ok(())
    }

    /// Applies `act` to all possible references.
    pub fn each(&mut self, mut act: impl FnMut(&mut Reference)) {
        self.possible.iter_mut().for_each(|possible| act(&mut possible.reference));
    }

    /// Lets the tasks come back, if the script has more for them. Returns whether it has.
    ///
    /// # Errors
    /// Some tasks have not left.
    pub fn comes_back(&mut self) -> Result<bool, Complaint> {
        if !self.script.goes_on() {
            return Ok(false);
        }
        self.keep(|reference| reference.is_deserted().then_some(()).ok_or("a task has not left".into()))?;
        self.each(Reference::come_back);
        self.is_over = false;
        self.history.clear();
        self.scripted = 0;
        Ok(true)
    }

    /// Keeps the references that agree with the kernel.
    fn keep(
        &mut self,
        mut agrees: impl FnMut(&mut Reference) -> Result<(), Complaint>,
    ) -> Result<(), Complaint> {
        let mut complaint = Complaint::new();
        self.possible
            .retain_mut(|possible| agrees(&mut possible.reference).map_err(|why| complaint = why).is_ok());
        if self.possible.is_empty() {
            return Err(complaint);
        }
        self.forget_equals();
        Ok(())
    }

    fn forget_equals(&mut self) {
        if self.possible.len() > 1 {
            let mut distinct: Vec<Possible> = Vec::new();
            for possible in self.possible.drain(..) {
                match distinct.iter_mut().find(|other| other.reference == possible.reference) {
                    Some(equal) => equal.ways |= possible.ways,
                    None => distinct.push(possible),
                }
            }
            self.possible = distinct;
        }
    }
}

fn name(who: Option<TaskId>) -> String {
    who.map_or("none".into(), |id| format!("task {id}"))
}
