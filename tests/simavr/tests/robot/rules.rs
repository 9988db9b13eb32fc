//! The verdict on the real images: any change of a rule of the centipede's table in the master's flash is
//! found.
//!
//! `SUPERBOT_RULES=all` tries all changes, on two threads; by default only some are tried.

use std::sync::Arc;
use std::thread;

use hormone::rule::Rule;
use simavr_harness::{Engine, Image, Images, RobotBuilder};
use simulation::{Run, Scenario, faults};
use superbot_tests_simavr::rules::Master;
use superbot_tests_simavr::rules::table::{RULES, WALK, mutants, table, walks};
use superbot_tests_simavr::{MILLISECOND, firmware};

const SECOND: u64 = 1_000 * MILLISECOND;

/// One in so many changes is tried, unless all are.
const EVERY: usize = 27;

/// The faults of a robot whose modules have this image.
fn verdict(master: &[u8]) -> Vec<String> {
    let master = Arc::new(Image::parse(master).expect("it is an image"));
    let firmware = Images { master, ..firmware() };
    let Scenario { wiring, timeline, .. } = Scenario::from_toml(&walks()).expect("the file is right");
    let robot = RobotBuilder::wired(firmware, &wiring).seed(1).power_up_within(40 * MILLISECOND);
    let mut run = Run::new(Engine::new(robot.build().expect("it can be built"), 1), timeline, SECOND);
    while run.step(WALK * SECOND).expect("the events can happen") {}
    faults(&run, true)
}

#[test]
fn the_table_as_it_is_is_right() {
    assert_eq!(verdict(Master::read().file()), [""; 0]);
}

#[test]
fn a_rule_that_is_changed_in_flash_is_found() {
    let master = Master::read();
    let every =
        if std::env::var_os("SUPERBOT_RULES").is_some_and(|which| which == "all") { 1 } else { EVERY };
    let changes: Vec<(usize, Rule)> = (0..RULES)
        .flat_map(|place| mutants(place).into_iter().map(move |mutant| (place, mutant)))
        .step_by(every)
        .collect();
    let found = |&(place, mutant): &(usize, Rule)| {
        let faults = verdict(&master.with(place, mutant));
        let is_found = faults.iter().any(|fault| fault.contains("the gait was wrong"));
        (!is_found).then(|| format!("{mutant:?} for {:?}: {faults:?}", table()[place]))
    };
    let half = changes.len().div_ceil(2);
    let missed: Vec<String> = thread::scope(|scope| {
        let halves: Vec<_> = changes
            .chunks(half)
            .map(|part| scope.spawn(|| part.iter().filter_map(found).collect::<Vec<_>>()))
            .collect();
        halves.into_iter().flat_map(|half| half.join().expect("it does not panic")).collect()
    });
    assert_eq!(missed, [""; 0]);
    println!("{} changes found", changes.len());
}
