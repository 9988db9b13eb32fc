//! The bodies of jobs. They capture nothing, so their work is stored here.

use std::cell::RefCell;
use std::rc::Rc;

use kernel::JobContext;

/// The work of the jobs; it gets the number of the job.
type Work = Rc<dyn Fn(usize, &mut JobContext)>;

std::thread_local! {
    static WORK: RefCell<Option<Work>> = const { RefCell::new(None) };
}

/// A body for each job.
pub const BODIES: [fn(&mut JobContext); 4] = [body::<0>, body::<1>, body::<2>, body::<3>];

fn body<const JOB: usize>(context: &mut JobContext) {
    let work = WORK.with_borrow(|work| work.clone()).expect("jobs run inside of `with_work`");
    work(JOB, context);
}

/// Makes `work` the work of the jobs while `run` runs.
pub fn with_work<R>(work: impl Fn(usize, &mut JobContext) + 'static, run: impl FnOnce() -> R) -> R {
    WORK.set(Some(Rc::new(work)));
    let result = run();
    WORK.set(None);
    result
}
