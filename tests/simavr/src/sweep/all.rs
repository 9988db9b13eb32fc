//! The sweep of all paths, on all cores.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::interruption::{Findings, Order, Share, Subject, sweep_path};
use super::paths::Program;
use crate::target::Target;

/// How much is swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Everything.
    Whole,
    /// Single interrupts, at every boundary whose number is a multiple of this.
    Sample(usize),
}

/// The findings of all sweeps together.
#[derive(Clone, Debug, Default)]
pub struct Total {
    pub single: Findings,
    pub pairs: Findings,
}

impl Extent {
    /// Into how many shares a path's sweep is divided, and every how many-th boundary is swept. It is the
    /// same on any number of cores, so that the output is, too. Each share runs the image up to the path.
    fn shares(self) -> (usize, usize) {
        match self {
            Extent::Whole => (8, 1),
            Extent::Sample(step) => (2, step),
        }
    }
}

/// Sweeps every path of `programs`, and reports each as it is done.
///
/// # Panics
/// When the images are not there, or are wrong without an interrupt.
pub fn sweep_all<'p>(
    target: &'static Target,
    programs: impl IntoIterator<Item = &'p Program>,
    extent: Extent,
    mut tell: impl FnMut(String),
) -> Total {
    let mut total = Total::default();
    for program in programs {
        let subject = Subject::new(target, target.image(program.image));
        let mut all_of_program = Findings::default();
        for (path, order) in sweeps(program, extent) {
            let findings = sweep(&subject, path, order, extent);
            tell(line(program, path, order, &findings));
            findings.failures.iter().for_each(|failure| tell(format!("    {failure}")));
            all_of_program.add(&findings);
            match order {
                Order::Single => total.single.add(&findings),
                Order::Pair | Order::PairAtSwitch => total.pairs.add(&findings),
            }
        }
        let stacks = subject.stacks().zip(&all_of_program.depths);
        let stacks: Vec<_> = stacks.map(|((name, size), used)| format!("{name} {used}/{size}")).collect();
        tell(format!("{:15}  stacks, bytes used: {}", program.image, stacks.join(", ")));
    }
    total
}

fn sweeps(program: &Program, extent: Extent) -> Vec<(u8, Order)> {
    let paths = 0..program.paths.len() as u8;
    let mut sweeps: Vec<_> = paths.clone().map(|path| (path, Order::Single)).collect();
    if extent == Extent::Whole {
        sweeps.extend(paths.map(|path| (path, Order::PairAtSwitch)));
        sweeps.extend(program.in_pairs.iter().map(|&path| (path, Order::Pair)));
    }
    sweeps
}

fn line(program: &Program, path: u8, order: Order, findings: &Findings) -> String {
    let Findings { boundaries, runs, failed, longest_wait, .. } = findings;
    let name = program.paths[usize::from(path)];
    let interruptions = match order {
        Order::Single => format!("one interrupt   waits {longest_wait:3} cycles"),
        Order::Pair => "two interrupts".to_owned(),
        Order::PairAtSwitch => "two interrupts, at a switch".to_owned(),
    };
    format!(
        "{:15}  {name:40}  {boundaries:5} boundaries  {runs:7} runs  {failed:5} failed  {interruptions}",
        program.image
    )
    .trim_end()
    .to_owned()
}

fn sweep(subject: &Subject, path: u8, order: Order, extent: Extent) -> Findings {
    let (shares, step) = extent.shares();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= shares {
                return done;
            }
            let share = Share { number: number * step, of: shares * step };
            done.push((number, sweep_path(subject, path, order, share)));
        }
    };
    let mut done: Vec<_> = thread::scope(|scope| {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("it has not panicked")).collect()
    });
    done.sort_by_key(|&(number, _)| number);
    let mut all = Findings::default();
    done.iter().for_each(|(_, findings)| all.add(findings));
    all
}
