//! Holds a kernel that plays a script against the reference: who runs and what each call returns must be the
//! same at every step.

use std::fmt;

use crate::call::{Call, Outcome};
use crate::reference::{Reference, TaskId};
use crate::setup::Setup;
use crate::step::Step;

/// Says what happens.
pub trait Script: 'static {
    /// What happens next; `None` at the end.
    fn next(&mut self, reference: &Reference) -> Option<Step>;

    /// After the end, when the objects are empty and the tasks have left: whether they come back for more.
    fn goes_on(&mut self) -> bool {
        false
    }
}

/// Who did what, in order; `None` while no task ran.
type History = Vec<(Option<TaskId>, Step)>;

/// What the kernel did otherwise than the reference.
pub type Complaint = String;

/// The kernel did something else than the reference.
pub struct Disagreement {
    setup: Setup,
    history: History,
    what: Complaint,
}

impl Disagreement {
    /// What happened until then.
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

/// The numbers of ways in which things may have stood where the last interrupt came inside of a call, a bit
/// each.
pub type Ways = u128;

/// A script that was played to its end.
pub struct Played {
    setup: Setup,
    history: History,
    /// How many steps are the script's.
    scripted: usize,
    /// How many calls agreed.
    pub calls: u64,
    /// The ways with which all agrees.
    pub ways: Ways,
}

impl Played {
    /// The steps that came, without those of the leftover.
    pub fn steps(&self) -> impl Iterator<Item = &Step> {
        self.history.iter().map(|(_, step)| step).take(self.scripted)
    }

    /// All agrees, but not with what was played before.
    pub fn disagree(self, what: Complaint) -> Box<Disagreement> {
        let Played { setup, history, .. } = self;
        Box::new(Disagreement { setup, history, what })
    }
}

/// How things may stand.
struct Possible {
    reference: Reference,
    ways: Ways,
}

/// A script on its way, with how things may stand.
pub struct Referee<S> {
    /// One, unless an interrupt has come inside of a call: until it shows which came first, all that may be.
    possible: Vec<Possible>,
    setup: Setup,
    script: S,
    is_over: bool,
    history: History,
    /// How many steps are the script's.
    scripted: usize,
    calls: u64,
}

impl<S: Script> Referee<S> {
    /// At the start of a kernel with the objects of `setup`.
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

    /// The script, and what was played; or what did not agree.
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

    /// Whether a task may run, as far as the reference goes.
    pub fn may_run(&self) -> bool {
        self.possible.iter().any(|possible| possible.reference.running().is_some())
    }

    /// The next step of the one who runs: what the script says, and after its end, what is left to do.
    ///
    /// # Errors
    /// Another should run.
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
            expected => Err(format!("{call:?} returns {outcome:?} at the start, but should {expected:?}")),
        })
    }

    /// A task's call has returned.
    ///
    /// # Errors
    /// Another should run, or it should have returned something else.
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

    /// Settles what the running task does.
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

    /// An interrupt is about to be handled, where things may stand in any of the `ways`.
    ///
    /// # Errors
    /// There are none.
    pub fn branch(&mut self, ways: impl Fn(&Reference) -> Vec<Reference>) -> Result<(), Complaint> {
        let numbered = |possible: &Possible| {
            let ways = ways(&possible.reference);
            let is_at_rest = ways.len() == 1;
            // More ways than bits would share the last.
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

    /// Does the same to all references.
    pub fn each(&mut self, mut act: impl FnMut(&mut Reference)) {
        self.possible.iter_mut().for_each(|possible| act(&mut possible.reference));
    }

    /// Lets the tasks come back, if the script has more for them. Returns whether it has.
    ///
    /// # Errors
    /// Some have not left.
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
