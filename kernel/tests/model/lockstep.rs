//! Runs the kernel and the reference side by side: who runs and what each call returns must be the same at every step.

use std::any::Any;
use std::cell::{RefCell, RefMut};
use std::fmt;
use std::panic::{self, AssertUnwindSafe};
use std::ptr;
use std::rc::Rc;
use std::sync::{Mutex, PoisonError};

use kernel::{Boot, Interrupt, Never, Task, host};

use crate::call::{Call, Outcome, Setup, Step};
use crate::reference::{Reference, TaskId};
use crate::world::{self, Belongings, World};

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
    pub history: History,
    what: String,
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
pub fn play<S: Script>(real: &Setup, supposed: &Setup, script: S) -> (S, Result<u64, Disagreement>) {
    /// The pool of messages is one for the whole process.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _one_at_a_time = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);

    let reference = Reference::new(supposed, world::pool_most_used(), world::pool_exhausted());
    let progress = Progress { reference, script, is_over: false, history: Vec::new(), calls: 0 };
    let world = Box::into_raw(Box::new(World::new(real)));
    // SAFETY: it is freed only at the end of this function.
    let world: &'static World = unsafe { &*world };
    let lockstep = Rc::new(Lockstep { world, progress: RefCell::new(progress) });
    let played = panic::catch_unwind(AssertUnwindSafe(|| {
        host::run(|boot| lockstep.start(boot, real), |interrupt| lockstep.idle(interrupt));
    }));
    world.empty_queues();
    // SAFETY: the kernel has dropped the tasks and forgotten the timers, and nothing else knows it but `lockstep`.
    drop(unsafe { Box::from_raw(ptr::from_ref(world).cast_mut()) });
    let Progress { script, history, calls, .. } =
        Rc::into_inner(lockstep).expect("the tasks are dropped").progress.into_inner();
    match played {
        Ok(()) => (script, Ok(calls)),
        Err(panic) => (script, Err(Disagreement { history, what: message(panic) })),
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
    /// Not borrowed while the kernel is called, which may run another task.
    progress: RefCell<Progress<S>>,
}

struct Progress<S> {
    reference: Reference,
    script: S,
    is_over: bool,
    history: History,
    calls: u64,
}

impl<S: Script> Lockstep<S> {
    fn start(self: &Rc<Self>, boot: &mut Boot, setup: &Setup) {
        for (id, (stack, &priority)) in self.world.tasks.iter().zip(&setup.priorities).enumerate() {
            let lockstep = Rc::clone(self);
            stack.start(boot, priority, move |task| lockstep.run(id, task)).expect("a new stack");
        }
    }

    /// A task.
    fn run(&self, id: TaskId, task: &mut Task) -> Never {
        let mut own = Belongings::default();
        loop {
            match self.next_call(id) {
                Some(Call::Lock { mutex }) => self.section(id, task, mutex),
                Some(call) => {
                    let outcome = self.world.call_of_task(task, &mut own, call);
                    self.returned(id, outcome);
                }
                None => {
                    own = Belongings::default();
                    self.progress().reference.leave();
                    self.world.returns[id].wait(task);
                }
            }
        }
    }

    /// From the lock of a mutex to its unlock, which is the only call that can come next.
    fn section(&self, id: TaskId, task: &mut Task, mutex: usize) {
        let mut value = self.world.mutexes[mutex].lock(task);
        self.returned(id, Outcome::Number((*value).into()));
        *value = value.wrapping_add(1);
        self.next_call(id);
        drop(value);
        self.returned(id, Outcome::Nothing);
    }

    /// The next call of task `id`. Before it come the interrupts that strike the task where it is.
    fn next_call(&self, id: TaskId) -> Option<Call> {
        loop {
            match self.next(Some(id))? {
                Step::Call(call) => return Some(call),
                Step::Interrupt(calls) => host::interrupt(|interrupt| self.calls(interrupt, &calls)),
                Step::Ticks(ticks) => {
                    for _ in 0..ticks {
                        host::interrupt(|interrupt| self.tick(interrupt));
                    }
                }
            }
        }
    }

    /// While no task runs. Returns whether it goes on.
    fn idle(&self, interrupt: &mut Interrupt) -> bool {
        match self.next(None) {
            Some(Step::Call(call)) => unreachable!("no task runs that could make {call:?}"),
            Some(Step::Interrupt(calls)) => self.calls(interrupt, &calls),
            Some(Step::Ticks(ticks)) => {
                for _ in 0..ticks {
                    self.tick(interrupt);
                    if self.progress().reference.running().is_some() {
                        break;
                    }
                }
            }
            None => {
                self.calls(interrupt, &self.world.all_observations());
                return self.goes_on(interrupt);
            }
        }
        true
    }

    /// Lets the tasks come back, if the script has more for them.
    fn goes_on(&self, interrupt: &mut Interrupt) -> bool {
        let progress = &mut *self.progress();
        if !progress.script.goes_on() {
            return false;
        }
        progress.is_over = false;
        progress.history.clear();
        progress.reference.come_back();
        self.world.returns.iter().for_each(|task| task.post(interrupt));
        true
    }

    /// The next step of the one who runs, done by the reference if it is a call of that task's.
    fn next(&self, who: Option<TaskId>) -> Option<Step> {
        let progress = &mut *self.progress();
        let reference = &mut progress.reference;
        let runs = reference.running();
        agree(runs == who, || format!("{} runs, but {} should", name(who), name(runs)));
        let step = if progress.is_over { None } else { progress.script.next(reference) };
        progress.is_over = step.is_none();
        let step = match who {
            _ if step.is_some() => step,
            Some(_) => reference.is_in_section().then_some(Step::Call(Call::Unlock)),
            None => reference.leftover(),
        };
        if let Some(step) = &step {
            progress.history.push((who, step.clone()));
        }
        if let Some(Step::Call(call)) = step {
            reference.call(call);
        }
        step
    }

    /// A task's call has returned.
    fn returned(&self, id: TaskId, outcome: Outcome) {
        let mut progress = self.progress();
        progress.calls += 1;
        let runs = progress.reference.running();
        agree(runs == Some(id), || format!("a call of task {id} returns, but {} should run", name(runs)));
        let expected = progress.reference.returned();
        agree(expected == Some(outcome), || {
            format!("a call of task {id} returns {outcome:?}, but it should be {expected:?}")
        });
    }

    /// The handler of an interrupt that makes `calls`.
    fn calls(&self, interrupt: &mut Interrupt, calls: &[Call]) {
        let expected = self.progress().reference.interrupt(calls);
        for (&call, expected) in calls.iter().zip(expected) {
            let outcome = self.world.call(interrupt, &mut Belongings::default(), call);
            agree(outcome == expected, || {
                format!("{call:?} in an interrupt returns {outcome:?}, but it should be {expected:?}")
            });
        }
        self.progress().calls += calls.len() as u64;
    }

    /// The handler of the clock's interrupt.
    fn tick(&self, interrupt: &mut Interrupt) {
        self.progress().reference.tick();
        host::tick(interrupt);
    }

    fn progress(&self) -> RefMut<'_, Progress<S>> {
        self.progress.borrow_mut()
    }
}

/// Ends the run, without a word, if the kernel and the reference do not agree.
fn agree(is_so: bool, what: impl FnOnce() -> String) {
    if !is_so {
        panic::resume_unwind(Box::new(what()));
    }
}

fn name(who: Option<TaskId>) -> String {
    who.map_or("none".into(), |id| format!("task {id}"))
}
