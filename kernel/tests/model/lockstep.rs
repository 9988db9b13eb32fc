//! Runs the kernel on the host and the reference side by side.

use std::any::Any;
use std::array;
use std::cell::{Cell, RefCell, RefMut};
use std::panic::{self, AssertUnwindSafe};
use std::ptr;
use std::rc::Rc;

use kernel::{
    Boot, Context, Interrupt, JobContext, JobTaken, Never, Priority, Semaphore, Stack, Task, TaskHandle, host,
};
use model::call::{Call, Outcome};
use model::lives::Lives;
use model::parcel::Parcel;
use model::referee::{Complaint, Disagreement, Played, Referee, Script};
use model::reference::{Reference, TaskId};
use model::setup::Setup;
use model::step::{Handler, Interruption, Step};
use model::world::{Belongings, TASKS, World, priority};

use crate::jobs::{self, BODIES};

/// Plays `script` on a kernel with the objects of `real` and on a reference with those of `supposed`, which
/// should be the same. Returns the script, and what was played.
pub fn play<S: Script>(real: &Setup, supposed: &Setup, script: S) -> (S, Result<Played, Box<Disagreement>>) {
    let arrangement = real.arrangement();
    // The kernel keeps references to the objects forever, as to statics. So a few hundred bytes are leaked.
    Parcel::renew_pool();
    let stacks: &'static [Stack<0>; TASKS] = Box::leak(Box::new([const { Stack::new() }; TASKS]));
    let tasks: &'static [TaskHandle; TASKS] = Box::leak(Box::new(stacks.each_ref().map(Stack::task)));
    let semaphores = Box::leak(Box::new(World::semaphores(&arrangement)));
    let lockstep = Rc::new(Lockstep {
        world: Box::leak(Box::new(World::new(&arrangement, tasks, semaphores, BODIES))),
        stacks,
        returns: Box::leak(Box::new(array::from_fn(|_| Semaphore::new(0)))),
        priorities: arrangement.priorities.map(priority),
        observations: real.all_observations(),
        is_in_tick: Cell::new(false),
        lives: Lives::new(),
        referee: RefCell::new(Referee::new(supposed, script)),
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
    let referee = Rc::into_inner(lockstep).expect("the tasks are dropped").referee.into_inner();
    referee.finish(played.map_err(message))
}

fn message(panic: Box<dyn Any + Send>) -> String {
    match panic.downcast::<String>() {
        Ok(message) => *message,
        Err(other) => other.downcast_ref::<&str>().unwrap_or(&"a panic").to_string(),
    }
}

/// Ends the run by a panic with the complaint, if there is one.
fn agreed<T>(result: Result<T, Complaint>) -> T {
    result.unwrap_or_else(|complaint| panic::resume_unwind(Box::new(complaint)))
}

struct Lockstep<S> {
    world: &'static World,
    stacks: &'static [Stack<0>; TASKS],
    /// The semaphores on which tasks wait that have left.
    returns: &'static [Semaphore; TASKS],
    priorities: [Priority; TASKS],
    observations: Vec<Call>,
    is_in_tick: Cell<bool>,
    lives: Lives,
    /// Not borrowed while a task calls the kernel, which may run another task.
    referee: RefCell<Referee<S>>,
}

/// The body of a task. It never leaves the thread that runs all of them.
struct OneThread<F>(F);

// SAFETY: the kernel of the host runs all tasks on the thread that starts them.
unsafe impl<F> Send for OneThread<F> {}

impl<F: FnOnce(&mut Task) -> R, R> OneThread<F> {
    fn call(self, task: &mut Task) -> R {
        (self.0)(task)
    }
}

/// The possible states of the reference when an interrupt occurs.
type Ways = Rc<dyn Fn(&Reference) -> Vec<Reference>>;

/// The possible states inside of the call that task `id` makes.
fn ways_in_call(id: TaskId) -> Ways {
    Rc::new(move |reference| reference.interrupted_in_call(id))
}

impl<S: Script> Lockstep<S> {
    /// Starts a task. Returns whether it was not started before.
    fn start(self: &Rc<Self>, context: &mut impl Context, id: TaskId) -> bool {
        let lockstep = Rc::clone(self);
        let run = OneThread(move |task: &mut Task| lockstep.run(id, task));
        // The call that kills a task has not returned as long as the task is dying.
        if !self.lives.is_dying(id) {
            // SAFETY: that call has returned; and a coroutine keeps its stack, which no other gets.
            unsafe { self.stacks[id].task().reuse(context) };
        }
        let is_started =
            self.stacks[id].start(context, self.priorities[id], move |task| run.call(task)).is_ok();
        if is_started {
            self.lives.begin(id);
        }
        is_started
    }

    /// Makes a call before the kernel runs.
    fn boot(self: &Rc<Self>, boot: &mut Boot, call: Call) {
        let outcome = match call {
            Call::Start { task } => self.start(boot, task).into(),
            Call::Kill { task } => self.lives.killing(task, || self.world.call_of_boot(boot, call)),
            _ => self.world.call_of_boot(boot, call),
        };
        agreed(self.referee().booted(call, outcome));
    }

    /// The body of a task.
    fn run(self: &Rc<Self>, id: TaskId, task: &mut Task) -> Never {
        let mut own = Belongings::default();
        loop {
            match self.next_call(id) {
                Some((call, interruption)) if call.locks() => self.section(id, task, call, interruption),
                Some((Call::Exit, interruption)) => return self.exit(id, interruption, task),
                Some((Call::RunJobs { jobs }, interruption)) => {
                    own.drop_messages();
                    let Err(JobTaken) = self.called(id, interruption, || self.world.run_jobs(task, jobs));
                    self.returned(id, Outcome::JobTaken);
                }
                Some((call, interruption)) => {
                    let outcome = self.called(id, interruption, || match call {
                        Call::Start { task: id } => self.start(task, id).into(),
                        Call::Kill { task: other } if other == id => {
                            self.lives.ending(id, || self.world.call_of_task(task, &mut own, call))
                        }
                        Call::Kill { task: other } => {
                            self.lives.killing(other, || self.world.call_of_task(task, &mut own, call))
                        }
                        _ => self.world.call_of_task(task, &mut own, call),
                    });
                    self.returned(id, outcome);
                }
                None => {
                    own = Belongings::default();
                    self.referee().each(Reference::leave);
                    self.returns[id].wait(task);
                }
            }
        }
    }

    fn exit(self: &Rc<Self>, id: TaskId, interruption: Option<Interruption>, task: &mut Task) -> Never {
        self.lives.end(id);
        self.called(id, interruption, || task.exit())
    }

    /// The body of a job. It begins when the call that waited for its signal returns.
    fn job(self: &Rc<Self>, job: usize, context: &mut JobContext) {
        host::cancel_arrival();
        let id = self.running(context);
        self.returned(id, Outcome::Number(job as u16));
        let mut own = Belongings::default();
        loop {
            let (call, interruption) = self.next_call(id).expect("a job ends itself");
            if call == Call::EndJob {
                own.drop_messages();
                if let Some(interruption) = interruption {
                    host::arrive_later(interruption.after, self.interruption(interruption, ways_in_call(id)));
                }
                return;
            }
            let outcome = self.called(id, interruption, || match call {
                Call::Start { task } => self.start(context, task).into(),
                Call::Kill { task } => {
                    self.lives.killing(task, || self.world.call_of_job(context, &mut own, call))
                }
                _ => self.world.call_of_job(context, &mut own, call),
            });
            self.returned(id, outcome);
        }
    }

    /// Locks a mutex and unlocks it, which is the only call that can come next.
    fn section(self: &Rc<Self>, id: TaskId, task: &mut Task, call: Call, interruption: Option<Interruption>) {
        let mut value = match self.called(id, interruption, || self.world.lock(task, call)) {
            Ok(value) => value,
            Err(outcome) => return self.returned(id, outcome),
        };
        self.returned(id, Outcome::Number((*value).into()));
        *value = value.wrapping_add(1);
        let interruption = self.next_call(id).and_then(|(_, interruption)| interruption);
        self.called(id, interruption, || drop(value));
        self.returned(id, Outcome::Nothing);
    }

    /// The next call of task `id`, and the interruption inside of it. Before that, handles the interrupts
    /// that occur while the task is between calls.
    fn next_call(self: &Rc<Self>, id: TaskId) -> Option<(Call, Option<Interruption>)> {
        loop {
            match self.next(Some(id))? {
                Step::Call(call, interruption) => return Some((call, interruption)),
                Step::Interrupt(handler) => host::interrupt(|interrupt| self.handle(interrupt, &handler)),
                Step::Silence(_) => {}
            }
        }
    }

    /// Makes a call of task `id`.
    fn called<R>(
        self: &Rc<Self>,
        id: TaskId,
        interruption: Option<Interruption>,
        call: impl FnOnce() -> R,
    ) -> R {
        self.interrupted(interruption, ways_in_call(id), call)
    }

    /// Does `work`, with the interruption; the reference is in one of the states `ways` then.
    fn interrupted<R>(
        self: &Rc<Self>,
        interruption: Option<Interruption>,
        ways: Ways,
        work: impl FnOnce() -> R,
    ) -> R {
        match interruption {
            Some(interruption) => {
                host::interrupted(interruption.after, self.interruption(interruption, ways), work)
            }
            None => work(),
        }
    }

    /// The handler of an interruption.
    fn interruption(
        self: &Rc<Self>,
        interruption: Interruption,
        ways: Ways,
    ) -> Box<dyn FnOnce(&mut Interrupt)> {
        let lockstep = Rc::clone(self);
        Box::new(move |interrupt| {
            agreed(lockstep.referee().branch(&*ways));
            lockstep.handle(interrupt, &interruption.handler);
            if let Some(then) = interruption.then {
                host::arrive_later(then.after, lockstep.interruption(*then, ways));
            }
        })
    }

    /// Called while no task runs. Returns whether the run continues.
    fn idle(self: &Rc<Self>, interrupt: &mut Interrupt) -> bool {
        match self.next(None) {
            Some(Step::Call(call, _)) => unreachable!("no task runs that could make {call:?}"),
            Some(Step::Interrupt(handler)) => self.handle(interrupt, &handler),
            Some(Step::Silence(ticks)) => {
                for _ in 0..ticks {
                    self.handle(interrupt, &Handler::Tick(None));
                    if self.referee().may_run() {
                        break;
                    }
                }
            }
            None => {
                self.handle(interrupt, &Handler::Calls(self.observations.clone()));
                return self.goes_on(interrupt);
            }
        }
        true
    }

    /// Lets the tasks come back, if the script has more for them.
    fn goes_on(&self, interrupt: &mut Interrupt) -> bool {
        let comes_back = agreed(self.referee().comes_back());
        if comes_back {
            self.returns.iter().for_each(|task| task.post(interrupt));
        }
        comes_back
    }

    /// The next step of the task that runs, if one does.
    fn next(&self, who: Option<TaskId>) -> Option<Step> {
        agreed(self.referee().next(who))
    }

    /// Called when a task's call has returned.
    fn returned(&self, id: TaskId, outcome: Outcome) {
        agreed(self.referee().returned(id, outcome));
    }

    /// The handler of an interrupt.
    fn handle(self: &Rc<Self>, interrupt: &mut Interrupt, handler: &Handler) {
        let calls = match handler {
            Handler::Calls(calls) => calls,
            Handler::Tick(interruption) => return self.tick(interrupt, interruption.as_deref().cloned()),
        };
        let call = |&call| match call {
            Call::Start { task } => self.start(interrupt, task).into(),
            _ => self.world.call_of_interrupt(interrupt, call),
        };
        let outcomes: Vec<_> = calls.iter().map(call).collect();
        agreed(self.referee().handled(calls, &outcomes));
    }

    /// The handler of a tick. A tick inside of another one only counts, and leaves what is due to the other.
    fn tick(self: &Rc<Self>, interrupt: &mut Interrupt, interruption: Option<Interruption>) {
        let is_inside = self.is_in_tick.replace(true);
        self.referee().each(Reference::pass);
        self.interrupted(interruption, Rc::new(Reference::interrupted_at_tick), || host::tick(interrupt));
        if !is_inside {
            self.referee().each(Reference::fire);
        }
        self.is_in_tick.set(is_inside);
    }

    fn running(&self, context: &mut impl Context) -> TaskId {
        let address = context.mask(kernel::running);
        let is_running = |stack: &Stack<0>| ptr::from_ref(stack).addr() == address;
        self.stacks.iter().position(is_running).expect("a task runs")
    }

    fn referee(&self) -> RefMut<'_, Referee<S>> {
        self.referee.borrow_mut()
    }
}
