//! A chain of five with the images that the robot is flashed with: head, three spines, tail.

use std::collections::BTreeSet;

use hormone::event::Event as Behaviour;
use simavr_harness::{Controller, Face, Faults};
use superbot_tests_simavr::MILLISECOND;
use superbot_tests_simavr::chain::{Chain, Count, Deed, back_of, front_of};
use superbot_tests_simavr::hormones::{HOP_AT_MOST, Hormones};

const MODULES: usize = 5;
const SECOND: u64 = 1000 * MILLISECOND;

/// A module finds its neighbours and type within this time from power-up.
const DISCOVERY: u64 = 150 * MILLISECOND;

#[test]
fn every_module_finds_its_neighbours_and_its_type() {
    for seed in 0..24 {
        let mut chain = Chain::new(MODULES, seed);
        assert_eq!(chain.mistaken().len(), MODULES, "nobody knows anything at power-up");
        chain.run(DISCOVERY);
        assert!(chain.mistaken().is_empty(), "seed {seed}: {:?}", chain.mistaken());
        chain.assert_alive();
    }
}

#[test]
fn hormones_reach_the_tail_in_turn() {
    let mut chain = Chain::new(MODULES, 1);
    let deeds = chain.run(5 * SECOND);
    chain.assert_right();
    Hormones::follow(MODULES, &deeds, chain.cycle()).assert_whole(9);
    assert_eq!(chain.sum(Count::RETRIES), 0, "on a good link nothing is repeated");
}

#[test]
fn the_outcome_depends_on_the_seed_only() {
    let outcome = |seed, threads| {
        let mut chain = Chain::on_threads(MODULES, seed, threads);
        chain.lose_frames(0.1);
        let deeds = chain.run(SECOND);
        (chain.robot().state_hash(), deeds)
    };
    let expected = outcome(1, 1);
    for threads in 1..=3 {
        assert_eq!(outcome(1, threads), expected, "{threads} threads");
    }
    let (hash, deeds) = outcome(2, 1);
    assert_ne!(hash, expected.0);
    assert_ne!(deeds, expected.1, "other frames are lost");
}
