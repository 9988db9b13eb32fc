//! The kernel on the MCU against the reference of the host tests, a part of it: `./x model` plays more. And
//! what it would find.

use model::setup::Setup;
use superbot_tests_simavr::image;
use superbot_tests_simavr::model::{Campaign, Player, Subject, Total, play_seed};
use superbot_tests_simavr::target::{ATMEGA128, TARGETS};

fn run(subject: &Subject, sequences: u64) -> Total {
    let total = Campaign { first_seed: 0, sequences }.run(subject);
    println!("{}: {total}", subject.target().part.name);
    total
}

#[test]
fn the_kernel_does_what_the_reference_does_on_every_mcu() {
    for subject in TARGETS.into_iter().flat_map(Subject::all) {
        let total = run(&subject, 6_000);
        assert!(total.failures.is_empty(), "{:?}", total.failures);
        assert!(total.counts.inside > 6_000, "few interrupts come inside of calls: {total}");
    }
}

/// Seeds whose scripts once did what the reference does not.
const FOUND: [u64; 2] = [
    2_001_950, // an ISR asks the priority of a task whose stack is free, and not another's yet
    21_427, // an ISR starts a task that ends itself, and runs on its stack still
];

#[test]
fn what_was_found_once_stays_mended() {
    let subject = Subject::new(ATMEGA128, image("model"));
    for first_seed in FOUND {
        let total = Campaign { first_seed, sequences: 1 }.run(&subject);
        assert!(total.failures.is_empty(), "{:?}", total.failures);
    }
}

/// Plays until a fault of the kernel shows.
fn find_fault(fault: &str) {
    let subject = Subject::new(ATMEGA128, image(&format!("fault-{fault}/model")));
    let total = run(&subject, 200_000);
    assert!(!total.failures.is_empty(), "{fault} is not found: {total}");
    total.failures.iter().for_each(|failure| println!("{failure}"));
}

#[test]
fn a_critical_section_taken_out_is_found() {
    find_fault("unmasked-post");
}

#[test]
fn a_stale_head_is_found() {
    find_fault("stale-head");
}

#[test]
fn a_kernel_that_differs_is_found_in_a_few_steps() {
    let subject = Subject::new(ATMEGA128, image("model"));
    let find = |alter: fn(&mut Setup)| {
        let mut player = Player::new(&subject);
        let found = (0..100).filter_map(|seed| play_seed(&mut player, seed, alter).err()).take(3);
        let shortest = found.min_by_key(|found| found.steps().count()).expect("it differs");
        assert!(shortest.steps().count() < 10, "{shortest}");
    };
    find(|real| real.semaphores.iter_mut().for_each(|signals| *signals += 1));
    find(|real| real.rooms.iter_mut().for_each(|room| *room += 1));
    find(|real| real.priorities.reverse());
    find(|real| real.jobs.reverse());
}
