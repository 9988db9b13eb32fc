//! Interprets scripts of kernel calls: each task, and the external interrupt, makes the calls that the
//! harness puts into its mailbox.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

#[path = "model/mailbox.rs"]
mod mailbox;
#[path = "model/objects.rs"]
mod objects;

use kernel::{Boot, Context, Interrupt, JobContext, Never, Semaphore, Task};
use model::call::{Call, Outcome};
use model::lives::Lives;
use model::world::{Belongings, JOBS_IN_ALL, priority};
use tests_images::start;

use mailbox::{HANDLER, Mailbox};
use objects::{STACKS, world};

board::tick_interrupt!();
board::external_interrupt!(interrupt => handle(interrupt));

static LIVES: Lives = Lives::new();

/// Tasks that have left wait here.
static GONE: Semaphore = Semaphore::new(0);

const BODIES: [fn(&mut JobContext); JOBS_IN_ALL] = [job::<0>, job::<1>, job::<2>, job::<3>];

kernel::main!(|boot| {
    let arrangement = mailbox::arrangement();
    objects::arrange(boot, &arrangement, BODIES);
    for task in 0..usize::from(arrangement.started) {
        start(start_task(boot, task));
        LIVES.begin(task);
    }
    boot_calls(boot);
});

/// Starts a task, with its priority from the arrangement.
#[inline(never)]
fn start_task(context: &mut impl Context, id: usize) -> Result<(), kernel::StartError> {
    let priority = priority(objects::priority_of(id));
    STACKS[id].start(context, priority, move |task| run(id, task))
}

/// Makes `Call::Start`. The stack of a killed task is freed first, unless the call that kills the task is not
/// over yet.
fn started(context: &mut impl Context, id: usize) -> Outcome {
    if !LIVES.is_dying(id) {
        // SAFETY: the call that killed it is over, and the tasks of scripts pin and lend nothing.
        unsafe { STACKS[id].task().reuse(context) };
    }
    let is_started = start_task(context, id).is_ok();
    if is_started {
        LIVES.begin(id);
    }
    is_started.into()
}

#[inline(never)]
fn boot_calls(boot: &mut Boot) {
    let mailbox = Mailbox::of(HANDLER);
    mailbox.begin();
    while let Some(call) = mailbox.next(HANDLER, &mut Belongings::default()) {
        mailbox.reply(match call {
            Call::Start { task } => started(boot, task),
            #[cfg(not(feature = "without-bytes"))]
            Call::Kill { task } => LIVES.killing(task, || world().call_of_boot(boot, call)),
            #[cfg(not(feature = "without-bytes"))]
            _ => world().call_of_boot(boot, call),
            #[cfg(feature = "without-bytes")]
            _ => tests_images::finish(),
        });
    }
}

/// The external interrupt.
#[inline(never)]
fn handle(interrupt: &mut Interrupt) {
    let mailbox = Mailbox::of(HANDLER);
    mailbox.begin();
    while let Some(call) = mailbox.next(HANDLER, &mut Belongings::default()) {
        mailbox.reply(match call {
            Call::Start { task } => started(interrupt, task),
            _ => world().call_of_interrupt(interrupt, call),
        });
    }
}

/// The body of a task.
#[inline(never)]
fn run(id: usize, task: &mut Task) -> Never {
    let mailbox = Mailbox::of(id);
    mailbox.begin();
    let mut own = Belongings::default();
    loop {
        let outcome = match mailbox.next(id, &mut own) {
            Some(call) if call.locks() => section(id, task, call),
            Some(Call::Exit) => {
                LIVES.end(id);
                return task.exit();
            }
            Some(call @ Call::Kill { task: other }) if other == id => {
                LIVES.ending(id, || world().call_of_task(task, &mut own, call))
            }
            Some(call @ Call::Kill { task: other }) => {
                LIVES.killing(other, || world().call_of_task(task, &mut own, call))
            }
            #[cfg(not(feature = "without-several"))]
            Some(Call::RunJobs { jobs }) => {
                let Err(kernel::JobTaken) = world().run_jobs(task, jobs);
                Outcome::JobTaken
            }
            Some(Call::Start { task: id }) => started(task, id),
            Some(call) => world().call_of_task(task, &mut own, call),
            None => {
                own = Belongings::default();
                GONE.wait(task);
                Outcome::Nothing
            }
        };
        mailbox.reply(outcome);
    }
}

/// From the lock of a mutex to its unlock, which is the only call that can come next.
#[inline(never)]
fn section(id: usize, task: &mut Task, call: Call) -> Outcome {
    let mailbox = Mailbox::of(id);
    let mut value = match world().lock(task, call) {
        Ok(value) => value,
        Err(outcome) => return outcome,
    };
    mailbox.reply(Outcome::Number((*value).into()));
    *value = value.wrapping_add(1);
    mailbox.next(id, &mut Belongings::default());
    drop(value);
    Outcome::Nothing
}

/// A job. It begins when the call that waited for its signal returns.
fn job<const JOB: u16>(context: &mut JobContext) {
    run_job(context, JOB);
}

#[cfg(feature = "without-several")]
fn run_job(_: &mut JobContext, _: u16) {}

#[cfg(not(feature = "without-several"))]
#[inline(never)]
fn run_job(context: &mut JobContext, job: u16) {
    let address = context.mask(kernel::running);
    let stack = STACKS.iter().position(|stack| core::ptr::from_ref(stack).addr() == address);
    let Some(id) = stack else { tests_images::finish() };
    let mailbox = Mailbox::of(id);
    mailbox.reply(Outcome::Number(job));
    let mut own = Belongings::default();
    while let Some(call) = mailbox.next(id, &mut own) {
        mailbox.reply(match call {
            Call::EndJob => break,
            Call::Start { task } => started(context, task),
            Call::Kill { task } => LIVES.killing(task, || world().call_of_job(context, &mut own, call)),
            _ => world().call_of_job(context, &mut own, call),
        });
    }
}
