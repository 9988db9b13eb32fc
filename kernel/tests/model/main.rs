//! Checks the kernel against a plain reference that was written from its documentation: with millions of
//! random calls, and with every sequence of calls of a small system.
//!
//! | variable | |
//! |---|---|
//! | `MODEL_CALLS` | the number of random calls, four million if not set |
//! | `MODEL_SEED` | the first random seed, 0 if not set; a failure reports its seed |
//! | `MODEL_DEPTH` | the number of steps in each sequence, 5 if not set |
//! | `MODEL_INTERRUPTED_DEPTH` | the same if an interrupt occurs inside of a call, 3 if not set |

mod jobs;
mod lockstep;

use std::env;

use kernel::Priority::{self, P2, P3, P4};
use model::exhaustive::Exhaustive;
use model::random::{Random, sections};
use model::referee::Disagreement;
use model::setup::Setup;
use model::shorten::shorten;
use model::systems::{self, System};
use model::world::TASKS;

use lockstep::play;

/// The number of steps in a random script.
const STEPS: usize = 300;

/// The value of an environment variable.
fn setting(name: &str, otherwise: u64) -> u64 {
    match env::var(name) {
        Ok(value) => value.parse().unwrap_or_else(|_| panic!("{name} is to be a number, not `{value}`")),
        Err(_) => otherwise,
    }
}

/// Draws a random setup and script and plays it, on a kernel altered by `alter`. Returns the number of
/// calls that agreed.
fn play_seed(seed: u64, alter: impl Fn(&mut Setup)) -> Result<u64, Box<Disagreement>> {
    let mut rng = fastrand::Rng::with_seed(seed);
    let supposed = Setup::random(&mut rng, TASKS, None);
    let mut real = supposed.clone();
    alter(&mut real);
    let script = Random::new(rng, supposed.clone(), STEPS, sections);
    let (_, played) = play(&real, &supposed, script);
    played
        .map(|played| played.calls)
        .map_err(|disagreement| shorten(disagreement, |replay| play(&real, &supposed, replay).1))
}

#[test]
fn millions_of_calls_drawn_by_lot_do_what_the_reference_does() {
    let wanted = setting("MODEL_CALLS", 4_000_000);
    let mut seed = setting("MODEL_SEED", 0);
    let mut calls = 0;
    while calls < wanted {
        calls += play_seed(seed, |_| {})
            .unwrap_or_else(|disagreement| panic!("with MODEL_SEED={seed}:\n{disagreement}"));
        seed += 1;
    }
    println!("{calls} calls");
}

/// In this script, a task blocks; an interrupt wakes it behind an equal that checks flags when it runs; and a
/// tick ends the wait of that equal before the task runs.
#[test]
fn two_interrupts_may_come_before_the_next_task_runs() {
    play_seed(146_612_349, |_| {}).unwrap_or_else(|disagreement| panic!("{disagreement}"));
}

/// Priorities of three tasks, and the ceiling of a mutex: equals; one above two; each above another; and a
/// ceiling that the highest task is above.
const ARRANGEMENTS: [([Priority; 3], Priority); 4] =
    [([P3, P3, P3], P3), ([P3, P2, P3], P2), ([P4, P3, P2], P2), ([P4, P3, P2], P3)];

/// The arrangements for systems without a mutex.
const WITHOUT_MUTEX: &[([Priority; 3], Priority)] = ARRANGEMENTS.split_at(3).0;

/// Plays all scripts that `scripts` makes of a system, in these arrangements.
fn play_all(
    arrangements: &[([Priority; 3], Priority)],
    system: fn([Priority; 3], Priority) -> System,
    scripts: fn(&System, usize) -> Exhaustive,
    length: usize,
) {
    for &(priorities, ceiling) in arrangements {
        let system = system(priorities, ceiling);
        let mut script = scripts(&system, length);
        let mut calls = 0;
        loop {
            let (played, result) = play(&system.setup, &system.setup, script);
            calls += result.unwrap_or_else(|disagreement| panic!("{disagreement}")).calls;
            script = played;
            if !script.wants_another_run() {
                break;
            }
        }
        let sequences = script.played;
        println!(
            "{priorities:?}, ceiling {ceiling:?}: {sequences} sequences of {length} steps, {calls} calls"
        );
    }
}

/// The number of steps in a sequence.
fn depth() -> usize {
    setting("MODEL_DEPTH", 5) as usize
}

/// The same if an interrupt occurs inside of a call.
fn interrupted_depth() -> usize {
    setting("MODEL_INTERRUPTED_DEPTH", 3) as usize
}

#[test]
fn every_sequence_of_calls_of_three_tasks_does_what_the_reference_does() {
    play_all(&ARRANGEMENTS, systems::messages, Exhaustive::new, depth());
}

#[test]
fn an_interrupt_inside_of_a_call_comes_as_if_before_or_after_it_in_every_sequence() {
    play_all(&ARRANGEMENTS, systems::messages, Exhaustive::with_interruptions, interrupted_depth());
}

#[test]
fn so_it_is_where_tasks_wait_for_several_semaphores() {
    play_all(WITHOUT_MUTEX, systems::several, Exhaustive::new, depth().saturating_sub(1));
    play_all(WITHOUT_MUTEX, systems::several, Exhaustive::with_interruptions, interrupted_depth());
}

#[test]
fn so_it_is_where_waits_time_out() {
    play_all(&ARRANGEMENTS, systems::timeouts, Exhaustive::new, depth().saturating_sub(1));
    play_all(
        &ARRANGEMENTS,
        systems::timeouts,
        Exhaustive::with_interruptions,
        interrupted_depth().saturating_sub(1),
    );
}

#[test]
fn so_it_is_where_tasks_wait_on_a_pipe() {
    play_all(WITHOUT_MUTEX, systems::pipe, Exhaustive::new, depth().saturating_sub(1));
    play_all(WITHOUT_MUTEX, systems::pipe, Exhaustive::with_interruptions, interrupted_depth());
}

#[test]
fn so_it_is_where_jobs_run() {
    play_all(WITHOUT_MUTEX, systems::jobs, Exhaustive::new, depth().saturating_sub(1));
    play_all(
        WITHOUT_MUTEX,
        systems::jobs,
        Exhaustive::with_interruptions,
        interrupted_depth().saturating_sub(1),
    );
}

#[test]
fn so_it_is_where_tasks_act_on_tasks() {
    play_all(&ARRANGEMENTS, systems::control, Exhaustive::new, depth().saturating_sub(2));
    play_all(
        &ARRANGEMENTS,
        systems::control,
        Exhaustive::with_interruptions,
        interrupted_depth().saturating_sub(1),
    );
}

#[test]
fn a_kernel_that_differs_is_found_in_a_few_steps() {
    let find = |alter: fn(&mut Setup)| {
        // Not all scripts become short: a deadline may depend on every tick before it.
        let found = (0..1000).filter_map(|seed| play_seed(seed, alter).err()).take(3);
        let shortest = found.min_by_key(|found| found.steps().count()).expect("it differs");
        assert!(shortest.steps().count() < 15, "{shortest}");
    };
    find(|real| real.semaphores.iter_mut().for_each(|signals| *signals += 1));
    find(|real| real.rooms.iter_mut().for_each(|room| *room += 1));
    find(|real| real.priorities.reverse());
    find(|real| real.ceilings.fill(Priority::P7));
    find(|real| real.jobs.reverse());
}
