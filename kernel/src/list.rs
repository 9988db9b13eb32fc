//! Tasks out of the middle of a list.

use crate::context::Context;
use crate::masked::Masked;
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
            if first.is(task) {
                semaphore.set_first(masked, task.link.get(masked));
                walk::end(masked);
                then(masked);
                return Step::Done(true);
            }
            let before = match place {
                Some(place) if walk::goes_on(masked) && place.began_with.is(first) => place.before,
                _ => {
                    walk::begin(masked);
                    first
                }
            };
            match before.link.get(masked).task() {
                Some(next) if next.is(task) => {
                    before.link.set(masked, task.link.get(masked));
                    walk::end(masked);
                    then(masked);
                    Step::Done(true)
                }
                Some(next) => Step::On(Place { before: next, began_with: first }),
                None => {
                    walk::end(masked);
                    Step::Done(false)
                }
            }
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
