//! The sweep of everything, on all cores.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use super::paths::PROGRAMS;
use super::strike::{Findings, Order, Share, Subject, sweep_path};
use crate::image;

/// How much is swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All there is.
    Whole,
    /// Single strikes, at every boundary whose number is a multiple of this.
    Sample(usize),
}

/// What all sweeps together have found.
#[derive(Clone, Debug, Default)]
pub struct Total {
    pub single: Findings,
    pub pairs: Findings,
}

/// Paths are divided among the cores in so many shares.
const SHARES: usize = 8;

struct Job {
    program: usize,
    path: u8,
    order: Order,
    share: Share,
}

/// Sweeps every path, and tells of each as it is done, always in the same order and the same words.
///
/// # Panics
/// When the images are not there, or are wrong without any strike.
pub fn sweep_all(extent: Extent, mut tell: impl FnMut(String)) -> Total {
    let subjects: Vec<_> = PROGRAMS.iter().map(|program| Subject::new(image(program.image))).collect();
    let jobs = jobs(extent);
    let mut total = Total::default();
    let mut done = Findings::default();
    let mut depths = Findings::default();
    in_order(
        &jobs,
        |job| sweep_path(&subjects[job.program], job.path, job.order, job.share),
        |job, findings| {
            done.add(&findings);
            let is_last = |share: Share| extent != Extent::Whole || share.number + 1 == share.of;
            if !is_last(job.share) {
                return;
            }
            let done = std::mem::take(&mut done);
            let program = &PROGRAMS[job.program];
            let (sum, strikes) = match job.order {
                Order::Single => (&mut total.single, "one strike"),
                Order::Pair => (&mut total.pairs, "two strikes"),
            };
            let name = program.paths[usize::from(job.path)];
            tell(format!(
                "{:15}  {name:40}  {strikes:11}  {:6} boundaries  {:8} runs  {:6} failed",
                program.image, done.boundaries, done.runs, done.failed
            ));
            done.failures.iter().for_each(|failure| tell(format!("    {failure}")));
            // The stacks of one image are not those of another.
            sum.add(&Findings { depths: Vec::new(), ..done.clone() });
            depths.add(&Findings { depths: done.depths, ..Findings::default() });
            let is_last_of_image = jobs.iter().rfind(|other| other.program == job.program);
            if is_last_of_image.is_some_and(|last| last.path == job.path && last.order == job.order) {
                let depths = std::mem::take(&mut depths).depths;
                let stacks = subjects[job.program].stacks().zip(depths);
                let stacks: Vec<_> =
                    stacks.map(|((name, size), depth)| format!("{name} {depth}/{size}")).collect();
                tell(format!("{:15}  bytes of stacks used: {}", program.image, stacks.join(", ")));
            }
        },
    );
    total
}

fn jobs(extent: Extent) -> Vec<Job> {
    let mut jobs = Vec::new();
    for (program, which) in PROGRAMS.iter().enumerate() {
        let all = 0..which.paths.len() as u8;
        let singles = all.map(|path| (path, Order::Single));
        let pairs = which.struck_twice.iter().map(|&path| (path, Order::Pair));
        for (path, order) in singles.chain(pairs) {
            match extent {
                Extent::Whole => jobs.extend((0..SHARES).map(|number| {
                    let share = Share { number, of: SHARES };
                    Job { program, path, order, share }
                })),
                Extent::Sample(of) if order == Order::Single => {
                    jobs.push(Job { program, path, order, share: Share { number: 0, of } });
                }
                Extent::Sample(_) => {}
            }
        }
    }
    jobs
}

/// Does the jobs on all cores, and hands over what came of them in their order.
fn in_order<R: Send>(jobs: &[Job], work: impl Fn(&Job) -> R + Sync, mut take: impl FnMut(&Job, R)) {
    let next = AtomicUsize::new(0);
    let (sender, results) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            let (sender, next, work) = (sender.clone(), &next, &work);
            scope.spawn(move || {
                while let index = next.fetch_add(1, Ordering::Relaxed)
                    && let Some(job) = jobs.get(index)
                    && sender.send((index, work(job))).is_ok()
                {}
            });
        }
        drop(sender);
        let mut early = BTreeMap::new();
        let mut expected = 0;
        for (index, result) in results {
            early.insert(index, result);
            while let Some(result) = early.remove(&expected) {
                take(&jobs[expected], result);
                expected += 1;
            }
        }
    });
}
