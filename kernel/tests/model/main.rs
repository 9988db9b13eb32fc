//! The kernel against a plain reference, written from its documentation: calls drawn by lot by the million, and every
//! sequence of calls of a small system.
//!
//! | variable | |
//! |---|---|
//! | `MODEL_CALLS` | how many calls are drawn by lot, four million if not set |
//! | `MODEL_SEED` | where the lots begin, 0 if not set; a failure names its own |
//! | `MODEL_DEPTH` | how many steps each sequence has, 5 if not set |
//! | `MODEL_STRUCK_DEPTH` | the same where an interrupt strikes inside of a call, 3 if not set |

mod call;
mod exhaustive;
mod lockstep;
mod random;
mod reference;
mod shorten;
mod world;

use std::env;

use kernel::Priority;

use call::Setup;
use exhaustive::Exhaustive;
use lockstep::{Disagreement, play};
use random::Random;

/// Steps of a script drawn by lot.
const STEPS: usize = 300;

/// The value of an environment variable.
fn setting(name: &str, otherwise: u64) -> u64 {
    match env::var(name) {
        Ok(value) => value.parse().unwrap_or_else(|_| panic!("{name} is to be a number, not `{value}`")),
        Err(_) => otherwise,
    }
}

/// Draws a setup and a script by lot and plays it, on a kernel altered by `alter`. Returns how many calls agreed.
fn play_seed(seed: u64, alter: impl Fn(&mut Setup)) -> Result<u64, Box<Disagreement>> {
    let mut rng = fastrand::Rng::with_seed(seed);
    let supposed = Setup::random(&mut rng);
    let mut real = supposed.clone();
    alter(&mut real);
    let script = Random::new(rng, supposed.clone(), STEPS);
    let (_, played) = play(&real, &supposed, script);
    played.map_err(|disagreement| shorten::shorten(&real, &supposed, disagreement))
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

/// Plays all of `scripts`, of `length` steps, in several arrangements of priorities.
fn play_all(scripts: fn(usize) -> Exhaustive, length: usize) {
    use Priority::{P2, P3, P4};
    // Equals, one above two, each above another; a ceiling for all, and one that the highest is above.
    for (priorities, ceiling) in
        [([P3, P3, P3], P3), ([P3, P2, P3], P2), ([P4, P3, P2], P2), ([P4, P3, P2], P3)]
    {
        let setup = exhaustive::setup(priorities, ceiling);
        let (script, result) = play(&setup, &setup, scripts(length));
        let calls = result.unwrap_or_else(|disagreement| panic!("{disagreement}"));
        let sequences = script.played;
        println!(
            "{priorities:?}, ceiling {ceiling:?}: {sequences} sequences of {length} steps, {calls} calls"
        );
    }
}

#[test]
fn every_sequence_of_calls_of_three_tasks_does_what_the_reference_does() {
    play_all(Exhaustive::new, setting("MODEL_DEPTH", 5) as usize);
}

#[test]
fn an_interrupt_inside_of_a_call_comes_as_if_before_or_after_it_in_every_sequence() {
    play_all(Exhaustive::with_strikes, setting("MODEL_STRUCK_DEPTH", 3) as usize);
}

#[test]
fn a_kernel_that_differs_is_found_in_a_few_steps() {
    let find = |alter: fn(&mut Setup)| {
        let found = (0..1000).find_map(|seed| play_seed(seed, alter).err()).expect("it differs");
        assert!(found.steps().count() < 15, "{found}");
    };
    find(|real| real.semaphores.iter_mut().for_each(|signals| *signals += 1));
    find(|real| real.rooms.iter_mut().for_each(|room| *room += 1));
    find(|real| real.priorities.reverse());
    find(|real| real.ceilings.fill(Priority::P7));
}
