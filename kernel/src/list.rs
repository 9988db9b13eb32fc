//! Tasks out of the middle of a list.

#[cfg(not(target_arch = "avr"))]
use core::ptr;

use crate::context::Context;
#[cfg(not(target_arch = "avr"))]
use crate::context::ThreadContext;
#[cfg(not(target_arch = "avr"))]
use crate::link::Link;
use crate::masked::Masked;
#[cfg(not(target_arch = "avr"))]
use crate::ready;
use crate::semaphore::Semaphore;
use crate::task::ControlBlock;
use crate::walk;

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
#[repr(u8)]
pub(crate) enum Found {
    NotStarted = 0,
    Ready = 1,
    Waiting = 2,
    Suspended = 3,
    /// It may not be suspended now.
    Refused = 4,
}

/// How a task is to be suspended.
#[derive(Clone, Copy)]
pub(crate) struct Suspension {
    /// Those of [`Flag`](crate::task::Flag) with which it may not be. Where there are none, it is left as it is.
    pub(crate) unless: u8,
    /// What is set with it: [`Flag::Held`](crate::task::Flag::Held) or nothing.
    pub(crate) flag: u8,
}

/// Searches `task` among those that are ready. Unless it is refused or suspended before, takes it from there and suspends it, as
/// `suspension` says; and does `then`, all in one masked section. It is not the running one then.
///
/// Linear in the number of ready tasks, in steps.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn search<R>(
    context: &mut impl ThreadContext,
    task: &'static ControlBlock,
    suspension: Suspension,
    then: impl Fn(&Masked, Found) -> R,
) -> R {
    // Who stands before the next one; nobody before the head.
    let mut before = None;
    loop {
        let result = context.mask(|masked| {
            let found = look(masked, task, suspension, &mut before)?;
            Some(then(masked, found))
        });
        if let Some(result) = result {
            return result;
        }
    }
}

/// One step of a search: `None` if it goes on.
#[cfg(not(target_arch = "avr"))]
fn look(
    masked: &Masked,
    task: &'static ControlBlock,
    suspension: Suspension,
    before: &mut Option<&'static ControlBlock>,
) -> Option<Found> {
    *before = before.filter(|_| walk::goes_on(masked));
    // Once in a walk: what changes this ends the walk.
    if before.is_none() {
        if !task.is_started(masked) {
            return Some(Found::NotStarted);
        }
        if task.has_any(masked, suspension.unless) {
            return Some(Found::Refused);
        }
        if task.is_suspended(masked) {
            return Some(Found::Suspended);
        }
        walk::begin(masked);
    }
    let last = ready::last_arrived(masked, task);
    let mut next = ready::behind(masked, *before);
    if next.is_none() {
        // Behind the idle task: on with the first of those that have arrived at its priority. Interrupts append.
        *before = last;
        next = last.map(|last| last.next_ready(masked));
    }
    let is_ready = next.is_some_and(|next| next.is(task));
    if !is_ready && next.map(ptr::from_ref) != last.map(ptr::from_ref) {
        *before = next;
        return None;
    }
    walk::end(masked);
    if suspension.unless != 0 {
        if is_ready {
            ready::take_after(masked, *before, task);
            task.link.set(masked, Link::PARKED);
        }
        task.suspend(masked);
        task.set_flags(masked, suspension.flag);
    }
    Some(if is_ready { Found::Ready } else { Found::Waiting })
}

/// Takes `task`, which is held, from those that wait for a semaphore, if it does.
///
/// Linear in the number of tasks that wait for the same, in steps.
#[cfg(not(target_arch = "avr"))]
pub(crate) fn withdraw(context: &mut impl ThreadContext, task: &'static ControlBlock) {
    while let Some(semaphore) = awaited(context, task) {
        expel(context, semaphore, task, |masked| task.link.set(masked, Link::PARKED));
    }
}

/// The semaphore that `task`, which is suspended, waits for, if it does.
#[cfg(not(target_arch = "avr"))]
fn awaited(context: &mut impl ThreadContext, task: &'static ControlBlock) -> Option<&'static Semaphore> {
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
            Some(next) => place = Some((next, began_with)),
            None => return link.semaphore(),
        }
    }
}
