//! Many scripts drawn by lot.

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

/// Steps of a script, before what is left over.
const STEPS: usize = 12;

/// Scripts of a seed with many interrupts each.
const SCRIPTS: usize = 16;

/// How much is played.
#[derive(Clone, Copy, Debug)]
pub struct Campaign {
    pub first_seed: u64,
    /// The last script may bring more.
    pub sequences: u64,
}

/// What came of a campaign.
#[derive(Debug, Default)]
pub struct Total {
    /// So many seeds were played.
    pub seeds: u64,
    pub counts: Counts,
    pub failures: Vec<Failure>,
}

/// A script whose outcome is not the reference's.
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

impl Campaign {
    /// Plays all sequences, on all cores; ends where one fails.
    pub fn run(self, subject: &Subject) -> Total {
        let (next_seed, played) = (AtomicU64::new(self.first_seed), AtomicU64::new(0));
        let work = || {
            let mut total = Total::default();
            let mut player = Player::new(subject);
            while played.load(Ordering::Relaxed) < self.sequences {
                let before = player.counts.sequences;
                let seed = next_seed.fetch_add(1, Ordering::Relaxed);
                total.seeds += 1;
                if let Err(disagreement) = play_seed(&mut player, seed, |_| {}) {
                    total.failures.push(Failure { mcu: subject.target().part.name, seed, disagreement });
                    played.store(self.sequences, Ordering::Relaxed);
                }
                played.fetch_add(player.counts.sequences - before, Ordering::Relaxed);
            }
            Total { counts: player.counts, ..total }
        };
        thread::scope(|scope| {
            let cores = thread::available_parallelism().map_or(1, usize::from);
            let workers: Vec<_> = (0..self.sequences.min(cores as u64)).map(|_| scope.spawn(work)).collect();
            let totals = workers.into_iter().map(|worker| worker.join().expect("it has not panicked"));
            totals.fold(Total::default(), Total::and)
        })
    }
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

/// Draws a setup by lot and plays scripts drawn by lot on a kernel altered by `alter`; then the last of them
/// again, with but one interrupt, at boundaries inside of one of its calls.
///
/// # Errors
/// The shortest script that still disagrees.
pub fn play_seed(
    player: &mut Player,
    seed: u64,
    alter: impl Fn(&mut Setup),
) -> Result<(), Box<Disagreement>> {
    let mut rng = Rng::with_seed(seed);
    let supposed = Setup::random(&mut rng, player.subject.tasks());
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
