//! Many random scripts.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use super::chip::Subject;
use super::lockstep::{Counts, Player};
use super::sweep::{STRIDE, Sweep};
use fastrand::Rng;
use model::random::{Random, cycles};
use model::referee::Disagreement;
use model::setup::Setup;
use model::shorten::shorten;

/// Steps of a script, before those that empty the objects.
const STEPS: usize = 12;

/// The scripts with many interrupts that each seed plays.
const SCRIPTS: usize = 16;

/// How much is played.
#[derive(Clone, Copy, Debug)]
pub struct Campaign {
    pub first_seed: u64,
    /// At least so many are played; the last seeds may add more.
    pub sequences: u64,
}

/// The results of a campaign.
#[derive(Debug, Default)]
pub struct Total {
    /// How many seeds were played.
    pub seeds: u64,
    pub counts: Counts,
    pub failures: Vec<Failure>,
}

/// A script for which the kernel differs from the reference.
pub struct Failure {
    pub mcu: &'static str,
    pub seed: u64,
    pub disagreement: Box<Disagreement>,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Failure { mcu, seed, disagreement } = self;
        write!(f, "again: ./x model {mcu} 1 {seed}\n{disagreement}")
    }
}

impl fmt::Debug for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Seeds that are played before the campaign checks whether they are enough, so that the seeds played do not
/// depend on the number and the speed of cores.
const BATCH: u64 = 16;

impl Campaign {
    /// Plays all sequences, on all cores. Stops if one fails.
    pub fn run(self, subject: &Subject) -> Total {
        let mut total = Total::default();
        // A single sequence is requested to play one seed again.
        let batch = if self.sequences == 1 { 1 } else { BATCH };
        while total.counts.sequences < self.sequences && total.failures.is_empty() {
            let first = self.first_seed.wrapping_add(total.seeds);
            total = total.and(play(subject, first, batch));
        }
        total
    }
}

/// Plays `count` seeds from `first` on, with 0 after the greatest, on all cores.
fn play(subject: &Subject, first: u64, count: u64) -> Total {
    let next = AtomicU64::new(0);
    let work = || {
        let mut total = Total::default();
        let mut player = Player::new(subject);
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return Total { counts: player.counts, ..total };
            }
            let seed = first.wrapping_add(index);
            total.seeds += 1;
            if let Err(disagreement) = play_seed(&mut player, seed, |_| {}) {
                total.failures.push(Failure { mcu: subject.target().part.name, seed, disagreement });
            }
        }
    };
    thread::scope(|scope| {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let workers: Vec<_> = (0..cores.min(BATCH as usize)).map(|_| scope.spawn(work)).collect();
        let totals = workers.into_iter().map(|worker| worker.join().expect("it has not panicked"));
        totals.fold(Total::default(), Total::and)
    })
}

impl Total {
    fn and(mut self, other: Total) -> Total {
        self.failures.extend(other.failures);
        Total {
            seeds: self.seeds + other.seeds,
            counts: self.counts.and(other.counts),
            failures: self.failures,
        }
    }
}

impl fmt::Display for Total {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Total { seeds, counts: Counts { sequences, calls, interrupts, inside }, failures } = self;
        let failed = failures.len();
        write!(
            f,
            "{sequences} sequences of {seeds} seeds, {calls} calls, {interrupts} interrupts, {inside} of \
             them inside of calls, {failed} disagreements"
        )
    }
}

/// Draws a random setup and plays random scripts on a kernel altered by `alter`; then plays the last of them
/// again, with only one interrupt, at boundaries inside of one of its calls.
///
/// # Errors
/// The shortest script that still disagrees.
pub fn play_seed(
    player: &mut Player,
    seed: u64,
    alter: impl Fn(&mut Setup),
) -> Result<(), Box<Disagreement>> {
    let mut rng = Rng::with_seed(seed);
    let supposed = Setup::random(&mut rng, player.subject.tasks(), player.subject.without());
    let mut real = supposed.clone();
    alter(&mut real);
    let outcome = (0..SCRIPTS).try_fold(Vec::new(), |_, _| {
        let script = Random::new(rng.fork(), supposed.clone(), STEPS, cycles);
        player.play(&real, &supposed, script, None).1.map(|played| played.steps().cloned().collect())
    });
    let (step, first) = (rng.usize(..STEPS), rng.usize(..STRIDE));
    let handler = Random::new(rng, supposed.clone(), 0, cycles).handler();
    let outcome = outcome.and_then(|steps| {
        Sweep { player, real: &real, supposed: &supposed, step, first, handler }.run(&steps)
    });
    outcome
        .map_err(|disagreement| shorten(disagreement, |replay| player.play(&real, &supposed, replay, None).1))
}
