//! Tasks out of the middle of a list.

use crate::arch;
use crate::context::{Context, ThreadContext};
use crate::link::Link;
use crate::masked::Masked;
use crate::ready;
use crate::semaphore::Semaphore;
use crate::task::ControlBlock;
use crate::walk;
use crate::{IDLE, KERNEL};

/// Takes `task` from those that wait for `semaphore`, and in the same masked section does `then`. Returns whether it was
/// one of them.
///
/// Linear in the number of waiting tasks, in steps.
#[inline(always)]
pub(crate) fn expel(
    context: &mut impl Context,
    semaphore: &Semaphore,
    task: &'static ControlBlock,
    then: impl Fn(&Masked),
) -> bool {
    let mut place: Option<Place> = None;
    loop {
        let step = context.mask(|masked| {
            let Some(first) = semaphore.first(masked) else {
                walk::end(masked);
                return Step::Done(false);
            };
            let link = task.link.get(masked);
            if first.is(task) {
                semaphore.set_first(masked, link);
            } else {
                let before = match place {
                    Some(place) if walk::goes_on(masked) && place.began_with.is(first) => place.before,
                    _ => {
                        walk::begin(masked);
                        first
                    }
                };
                match before.link.get(masked).task() {
                    Some(next) if next.is(task) => before.link.set(masked, link),
                    Some(next) => return Step::On(Place { before: next, began_with: first }),
                    None => {
                        walk::end(masked);
                        return Step::Done(false);
                    }
                }
            }
            walk::end(masked);
            then(masked);
            Step::Done(true)
        });
        match step {
            Step::On(next) => place = Some(next),
            Step::Done(result) => return result,
        }
    }
}

/// How far a walk has got: to `before`, in the list that began with `began_with`.
#[derive(Clone, Copy)]
struct Place {
    before: &'static ControlBlock,
    began_with: &'static ControlBlock,
}

/// What came of one step.
enum Step {
    On(Place),
    Done(bool),
}

/// What a search for a task has found.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Found {
    Ready,
    Waiting,
    Suspended,
    NotStarted,
    /// It may not be suspended now.
    Refused,
}

/// Why a task is to be suspended.
#[derive(Clone, Copy)]
pub(crate) struct Suspension {
    /// Those of [`Flag`](crate::task::Flag) with which it may not be.
    pub(crate) unless: u8,
    /// What is set with it: [`Flag::Held`](crate::task::Flag::Held) or nothing.
    pub(crate) flag: u8,
}

/// Searches `task` among those that are ready. If there is a `suspension`, and it is neither refused nor suspended before, takes
/// it from there and suspends it, all in one masked section. It is not the running one then.
///
/// Linear in the number of ready tasks, in steps.
#[inline(never)]
pub(crate) fn search(
    context: &mut impl ThreadContext,
    task: &'static ControlBlock,
    suspension: Option<Suspension>,
) -> Found {
    let mut place: Option<ReadyPlace> = None;
    loop {
        let step = context.mask(|masked| {
            if !task.is_started(masked) {
                return ReadyStep::Done(Found::NotStarted);
            }
            if suspension.is_some_and(|suspension| task.has_any(masked, suspension.unless)) {
                return ReadyStep::Done(Found::Refused);
            }
            if task.is_suspended(masked) {
                return ReadyStep::Done(Found::Suspended);
            }
            let step = if task.link.get(masked).is_end() {
                // What is ready is linked to another task.
                ReadyStep::Done(Found::Waiting)
            } else {
                let place = place.filter(|_| walk::goes_on(masked)).unwrap_or_else(|| {
                    walk::begin(masked);
                    ReadyPlace::Start
                });
                place.step(masked, task, suspension.is_some())
            };
            if let ReadyStep::Done(found) = step
                && let Some(Suspension { flag, .. }) = suspension
            {
                task.suspend(masked);
                task.set_flags(masked, flag);
                if found == Found::Ready {
                    walk::end(masked);
                    task.link.set(masked, Link::PARKED);
                }
            }
            step
        });
        match step {
            ReadyStep::On(next) => {
                place = Some(next);
                arch::part_sections();
            }
            ReadyStep::Done(result) => return result,
        }
    }
}

/// How far a walk along the ready tasks has got.
#[derive(Clone, Copy)]
enum ReadyPlace {
    Start,
    /// To this one in the list that begins with the head.
    Head(&'static ControlBlock),
    /// To `before`, among those that have arrived, of which `last` was the last.
    Arrived {
        before: &'static ControlBlock,
        last: &'static ControlBlock,
    },
}

enum ReadyStep {
    On(ReadyPlace),
    Done(Found),
}

impl ReadyPlace {
    /// One step on the way to `task`, which is taken out where it is found if `take` says so.
    #[inline(always)]
    fn step(self, masked: &Masked, task: &'static ControlBlock, take: bool) -> ReadyStep {
        let ready = &KERNEL.ready;
        match self {
            ReadyPlace::Start => {
                let head = ready.head.get(masked);
                if !head.is(task) {
                    return ReadyStep::On(ReadyPlace::Head(head));
                }
                if take {
                    ready::leave_head(masked);
                }
            }
            ReadyPlace::Head(before) if before.is(&IDLE) => {
                return match ready::last_arrived(masked, task) {
                    Some(last) => ReadyStep::On(ReadyPlace::Arrived { before: last, last }),
                    None => ReadyStep::Done(Found::Waiting),
                };
            }
            ReadyPlace::Head(before) => {
                let next = before.next_ready(masked);
                if !next.is(task) {
                    return ReadyStep::On(ReadyPlace::Head(next));
                }
                if take {
                    before.link.set(masked, task.link.get(masked));
                }
            }
            ReadyPlace::Arrived { before, last } => {
                // Interrupts append.
                if !ready::last_arrived(masked, task).is_some_and(|now| now.is(last)) {
                    return ReadyStep::On(ReadyPlace::Start);
                }
                let next = before.next_ready(masked);
                if !next.is(task) {
                    return match next.is(last) {
                        true => ReadyStep::Done(Found::Waiting),
                        false => ReadyStep::On(ReadyPlace::Arrived { before: next, last }),
                    };
                }
                if take {
                    ready::take_after(masked, before, task);
                }
            }
        }
        ReadyStep::Done(Found::Ready)
    }
}

/// The semaphore that `task`, which is suspended, waits for, if it does.
///
/// Linear in the number of tasks that wait for it, in steps.
#[inline(never)]
pub(crate) fn awaited(
    context: &mut impl ThreadContext,
    task: &'static ControlBlock,
) -> Option<&'static Semaphore> {
    let mut place: Option<(&'static ControlBlock, Link)> = None;
    loop {
        let (link, began_with) = context.mask(|masked| {
            // Interrupts wake the first, so none behind `task` before that itself, which shows in its link.
            let own = task.link.get(masked);
            match place {
                Some((before, began_with)) if walk::goes_on(masked) && began_with == own => {
                    (before.link.get(masked), own)
                }
                _ => {
                    walk::begin(masked);
                    (own, own)
                }
            }
        });
        match link.task() {
            Some(next) => {
                place = Some((next, began_with));
                arch::part_sections();
            }
            None => return link.semaphore(),
        }
    }
}
