//! Runs the kernel and the reference side by side: who runs and what each call returns must be the same at every step.

use std::any::Any;
use std::cell::{Cell, RefCell, RefMut};
use std::fmt;
use std::panic::{self, AssertUnwindSafe};
use std::rc::Rc;

use kernel::{Boot, Context, Interrupt, JobContext, JobTaken, Never, Priority, Task, host};

use crate::call::{Call, Handler, Outcome, Setup, Step, Strike};
use crate::jobs;
use crate::reference::{Reference, TaskId};
use crate::world::{Belongings, World};

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

/// The kernel did something else than the reference.
pub struct Disagreement {
    setup: Setup,
    history: History,
    what: String,
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

/// Plays `script` on a kernel with the objects of `real` and on a reference with those of `supposed`, which should be the
/// same. Gives the script back, and how many calls agreed.
pub fn play<S: Script>(real: &Setup, supposed: &Setup, script: S) -> (S, Result<u64, Box<Disagreement>>) {
    let references = vec![Reference::new(supposed)];
    let progress = Progress { references, script, is_over: false, history: Vec::new(), calls: 0 };
    let lockstep = Rc::new(Lockstep {
        world: World::new(real),
        priorities: real.priorities.clone(),
        is_in_tick: Cell::new(false),
        progress: RefCell::new(progress),
    });
    let start = |boot: &mut Boot| {
        for task in 0..real.started {
            assert!(lockstep.start(boot, task), "a new stack");
        }
        real.boot.iter().for_each(|&call| lockstep.boot(boot, call));
    };
    let run = || host::run(start, |interrupt| lockstep.idle(interrupt));
    let working = Rc::clone(&lockstep);
    let played = jobs::with_work(
        move |job, context| working.job(job, context),
        || panic::catch_unwind(AssertUnwindSafe(run)),
    );
    let Progress { script, history, calls, .. } =
        Rc::into_inner(lockstep).expect("the tasks are dropped").progress.into_inner();
    match played {
        Ok(()) => (script, Ok(calls)),
        Err(panic) => {
            let setup = supposed.clone();
            (script, Err(Box::new(Disagreement { setup, history, what: message(panic) })))
        }
    }
}

fn message(panic: Box<dyn Any + Send>) -> String {
    match panic.downcast::<String>() {
        Ok(message) => *message,
        Err(other) => other.downcast_ref::<&str>().unwrap_or(&"a panic").to_string(),
    }
}

struct Lockstep<S> {
    world: &'static World,
    priorities: Vec<Priority>,
    is_in_tick: Cell<bool>,
    /// Not borrowed while a task calls the kernel, which may run another.
    progress: RefCell<Progress<S>>,
}

/// How things may stand where an interrupt strikes.
type Ways = Rc<dyn Fn(&Reference) -> Vec<Reference>>;

/// Those inside of the call that task `id` is in.
fn ways_in_call(id: TaskId) -> Ways {
    Rc::new(move |reference| reference.struck_in_call(id))
}

struct Progress<S> {
    /// One, unless an interrupt has struck inside of a call: until it shows which came first, all that may be.
    references: Vec<Reference>,
    script: S,
    is_over: bool,
    history: History,
    calls: u64,
}

impl<S: Script> Lockstep<S> {
    /// Starts a task. Returns whether it was not started before.
    fn start(self: &Rc<Self>, context: &mut impl Context, id: TaskId) -> bool {
        let lockstep = Rc::clone(self);
        let run = move |task: &mut Task| lockstep.run(id, task);
        self.world.tasks[id].start(context, self.priorities[id], run).is_ok()
    }

    /// A call before the kernel runs.
    fn boot(self: &Rc<Self>, boot: &mut Boot, call: Call) {
        let outcome = match call {
            Call::Start { task } => self.start(boot, task).into(),
            _ => self.world.call_of_thread(boot, &mut Belongings::default(), call),
        };
        self.progress().keep(|reference| match reference.call_of_boot(call) {
            expected if expected == outcome => Ok(()),
            expected => Err(format!("{call:?} returns {outcome:?} at the start, but should {expected:?}")),
        });
    }

    /// A task.
    fn run(self: &Rc<Self>, id: TaskId, task: &mut Task) -> Never {
        let mut own = Belongings::default();
        loop {
            match self.next_call(id) {
                Some((Call::Lock { mutex }, strike)) => self.section(id, task, mutex, strike),
                Some((Call::Exit, strike)) => return self.called(id, strike, || task.exit()),
                Some((Call::RunJobs { jobs }, strike)) => {
                    own.drop_messages();
                    let Err(JobTaken) = self.called(id, strike, || self.world.run_jobs(task, jobs));
                    self.returned(id, Outcome::JobTaken);
                }
                Some((call, strike)) => {
                    let outcome = self.called(id, strike, || match call {
                        Call::Start { task: id } => self.start(task, id).into(),
                        _ => self.world.call_of_task(task, &mut own, call),
                    });
                    self.returned(id, outcome);
                }
                None => {
                    own = Belongings::default();
                    self.progress().references.iter_mut().for_each(Reference::leave);
                    self.world.returns[id].wait(task);
                }
            }
        }
    }

    /// A job, which begins as the call that waited for its signal returns.
    fn job(self: &Rc<Self>, job: usize, context: &mut JobContext) {
        host::cancel_arrival();
        let id = self.world.running(context);
        self.returned(id, Outcome::Number(job as u16));
        let mut own = Belongings::default();
        loop {
            let (call, strike) = self.next_call(id).expect("a job ends itself");
            if call == Call::EndJob {
                own.drop_messages();
                if let Some(strike) = strike {
                    host::arrive_later(strike.sections, self.strike(strike, ways_in_call(id)));
                }
                return;
            }
            let outcome = self.called(id, strike, || match call {
                Call::Start { task } => self.start(context, task).into(),
                _ => self.world.call_of_thread(context, &mut own, call),
            });
            self.returned(id, outcome);
        }
    }

    /// From the lock of a mutex to its unlock, which is the only call that can come next.
    fn section(self: &Rc<Self>, id: TaskId, task: &mut Task, mutex: usize, strike: Option<Strike>) {
        let mut value = self.called(id, strike, || self.world.mutexes[mutex].lock(task));
        self.returned(id, Outcome::Number((*value).into()));
        *value = value.wrapping_add(1);
        let strike = self.next_call(id).and_then(|(_, strike)| strike);
        self.called(id, strike, || drop(value));
        self.returned(id, Outcome::Nothing);
    }

    /// The next call of task `id`, and what strikes inside of it. Before it come the interrupts that strike the task where
    /// it is.
    fn next_call(self: &Rc<Self>, id: TaskId) -> Option<(Call, Option<Strike>)> {
        loop {
            match self.next(Some(id))? {
                Step::Call(call, strike) => return Some((call, strike)),
                Step::Interrupt(handler) => host::interrupt(|interrupt| self.handle(interrupt, &handler)),
                Step::Silence(_) => {}
            }
        }
    }

    /// Makes a call of task `id`.
    fn called<R>(self: &Rc<Self>, id: TaskId, strike: Option<Strike>, call: impl FnOnce() -> R) -> R {
        self.struck(strike, ways_in_call(id), call)
    }

    /// Does what is struck, where things stand in one of the `ways`.
    fn struck<R>(self: &Rc<Self>, strike: Option<Strike>, ways: Ways, work: impl FnOnce() -> R) -> R {
        match strike {
            Some(strike) => host::interrupted(strike.sections, self.strike(strike, ways), work),
            None => work(),
        }
    }

    /// What a strike does.
    fn strike(self: &Rc<Self>, strike: Strike, ways: Ways) -> Box<dyn FnOnce(&mut Interrupt)> {
        let lockstep = Rc::clone(self);
        Box::new(move |interrupt| {
            lockstep.progress().branch(&*ways);
            lockstep.handle(interrupt, &strike.handler);
            if let Some(then) = strike.then {
                host::arrive_later(then.sections, lockstep.strike(*then, ways));
            }
        })
    }

    /// While no task runs. Returns whether it goes on.
    fn idle(self: &Rc<Self>, interrupt: &mut Interrupt) -> bool {
        match self.next(None) {
            Some(Step::Call(call, _)) => unreachable!("no task runs that could make {call:?}"),
            Some(Step::Interrupt(handler)) => self.handle(interrupt, &handler),
            Some(Step::Silence(ticks)) => {
                for _ in 0..ticks {
                    self.handle(interrupt, &Handler::Tick(None));
                    if self.progress().references.iter().any(|reference| reference.running().is_some()) {
                        break;
                    }
                }
            }
            None => {
                self.handle(interrupt, &Handler::Calls(self.world.all_observations()));
                return self.goes_on(interrupt);
            }
        }
        true
    }

    /// Lets the tasks come back, if the script has more for them.
    fn goes_on(&self, interrupt: &mut Interrupt) -> bool {
        let mut progress = self.progress();
        if !progress.script.goes_on() {
            return false;
        }
        progress.keep(|reference| reference.is_deserted().then_some(()).ok_or("a task has not left".into()));
        progress.references.iter_mut().for_each(Reference::come_back);
        progress.is_over = false;
        progress.history.clear();
        self.world.returns.iter().for_each(|task| task.post(interrupt));
        true
    }

    /// The next step of the one who runs.
    fn next(&self, who: Option<TaskId>) -> Option<Step> {
        let mut progress = self.progress();
        progress.expect_running(who);
        let step = progress.step(who);
        if let Some(step) = &step {
            progress.history.push((who, step.clone()));
        }
        if let Some(Step::Call(call, _)) = step {
            progress.references.iter_mut().for_each(|reference| reference.call(call));
        }
        step
    }

    /// A task's call has returned.
    fn returned(&self, id: TaskId, outcome: Outcome) {
        let mut progress = self.progress();
        progress.calls += 1;
        progress.expect_running(Some(id));
        progress.keep(|reference| match reference.returned() {
            Some(expected) if expected == outcome => Ok(()),
            expected => Err(format!("task {id} is told {outcome:?}, but it should be {expected:?}")),
        });
    }

    /// The handler of an interrupt.
    fn handle(self: &Rc<Self>, interrupt: &mut Interrupt, handler: &Handler) {
        let calls = match handler {
            Handler::Calls(calls) => calls,
            Handler::Tick(strike) => return self.tick(interrupt, strike.as_deref().cloned()),
        };
        let call = |&call| match call {
            Call::Start { task } => self.start(interrupt, task).into(),
            _ => self.world.call(interrupt, &mut Belongings::default(), call),
        };
        let outcomes: Vec<_> = calls.iter().map(call).collect();
        let mut progress = self.progress();
        progress.calls += outcomes.len() as u64;
        progress.keep(|reference| match reference.interrupt(calls) {
            expected if expected == outcomes => Ok(()),
            expected => Err(format!("the handler is told {outcomes:?}, but it should be {expected:?}")),
        });
    }

    /// The handler of a tick. One inside of another only counts: what is due then is left to the other.
    fn tick(self: &Rc<Self>, interrupt: &mut Interrupt, strike: Option<Strike>) {
        let is_inside = self.is_in_tick.replace(true);
        self.progress().references.iter_mut().for_each(Reference::pass);
        self.struck(strike, Rc::new(Reference::struck_at_tick), || host::tick(interrupt));
        if !is_inside {
            self.progress().references.iter_mut().for_each(Reference::fire);
        }
        self.is_in_tick.set(is_inside);
    }

    fn progress(&self) -> RefMut<'_, Progress<S>> {
        self.progress.borrow_mut()
    }
}

impl<S: Script> Progress<S> {
    /// What the script says, and after its end, what is left to do.
    fn step(&mut self, who: Option<TaskId>) -> Option<Step> {
        let reference = &self.references[0];
        let step = if self.is_over { None } else { self.script.next(reference) };
        self.is_over = step.is_none();
        step.or_else(|| match who {
            Some(_) => reference.way_out().map(|call| Step::Call(call, None)),
            None => reference.leftover(),
        })
    }

    fn expect_running(&mut self, who: Option<TaskId>) {
        self.references.iter_mut().for_each(Reference::settle);
        self.keep(|reference| match reference.running() {
            expected if expected == who => Ok(()),
            expected => Err(format!("{} runs, but {} should", name(who), name(expected))),
        });
    }

    /// An interrupt is about to strike, where things may stand in any of the `ways`.
    fn branch(&mut self, ways: &dyn Fn(&Reference) -> Vec<Reference>) {
        self.references = self.references.iter().flat_map(ways).collect();
        if self.references.is_empty() {
            panic::resume_unwind(Box::new("another task should be struck".to_string()));
        }
    }

    /// Keeps the references that agree with the kernel. If none does, it ends the run, without a word yet.
    fn keep(&mut self, mut agrees: impl FnMut(&mut Reference) -> Result<(), String>) {
        let mut complaint = String::new();
        self.references.retain_mut(|reference| agrees(reference).map_err(|why| complaint = why).is_ok());
        if self.references.is_empty() {
            panic::resume_unwind(Box::new(complaint));
        }
        if self.references.len() > 1 {
            let mut distinct = Vec::new();
            for reference in self.references.drain(..) {
                if !distinct.contains(&reference) {
                    distinct.push(reference);
                }
            }
            self.references = distinct;
        }
    }
}

fn name(who: Option<TaskId>) -> String {
    who.map_or("none".into(), |id| format!("task {id}"))
}
