//! The verdict on the real images: a rule of the centipede's table that is changed in the master's flash is
//! found, whatever the change.
//!
//! `SUPERBOT_RULES=all` tries them all, on two threads; some stand for them otherwise.

#[path = "../../../simulation/tests/table/mod.rs"]
mod table;

use std::sync::Arc;
use std::thread;

use hormone::rule::Rule;
use simavr_harness::{Engine, Image, Images, RobotBuilder};
use simulation::{Run, Scenario, faults};
use superbot_tests_simavr::{MILLISECOND, images};
use table::{RULES, WALK, mutants, table, walks};

const SECOND: u64 = 1_000 * MILLISECOND;

/// One of so many is tried, unless all are.
const EVERY: usize = 27;

/// A rule as it lies in flash.
const BYTES: usize = size_of::<Rule>();

fn bytes(rule: Rule) -> [u8; BYTES] {
    // SAFETY: a rule has six bytes of data and no room between them.
    unsafe { std::mem::transmute(rule) }
}

/// The master's image and where the table begins in it. Fields stand in it as on the host, or it is not there.
fn master() -> (Vec<u8>, usize) {
    let file = std::fs::read(images().join("firmware-master.elf")).expect("./x build leaves it");
    let whole: Vec<u8> = table().into_iter().flat_map(bytes).collect();
    let places: Vec<usize> =
        (0..file.len() - whole.len()).filter(|&at| file[at..].starts_with(&whole)).collect();
    let &[place] = &places[..] else { panic!("the table lies at {places:?}") };
    (file, place)
}

/// What is wrong with a robot whose modules have this image.
fn verdict(master: &[u8]) -> Vec<String> {
    let image = |file: &[u8]| Arc::new(Image::parse(file).expect("it is an image"));
    let slave = std::fs::read(images().join("firmware-slave.elf")).expect("./x build leaves it");
    let firmware = Images { master: image(master), slave: image(&slave) };
    let Scenario { wiring, timeline, .. } = Scenario::from_toml(&walks()).expect("the file is right");
    let robot = RobotBuilder::wired(firmware, &wiring).seed(1).power_up_within(40 * MILLISECOND);
    let mut run = Run::new(Engine::new(robot.build().expect("it can be built"), 1), timeline, SECOND);
    while run.step(WALK * SECOND).expect("the events can happen") {}
    faults(&run, true)
}

#[test]
fn the_table_as_it_is_is_right() {
    assert_eq!(verdict(&master().0), [""; 0]);
}

#[test]
fn a_rule_that_is_changed_in_flash_is_found() {
    let (file, start) = master();
    let every =
        if std::env::var_os("SUPERBOT_RULES").is_some_and(|which| which == "all") { 1 } else { EVERY };
    let changes: Vec<(usize, Rule)> = (0..RULES)
        .flat_map(|place| mutants(place).into_iter().map(move |mutant| (place, mutant)))
        .step_by(every)
        .collect();
    let found = |&(place, mutant): &(usize, Rule)| {
        let mut file = file.clone();
        let at = start + place * BYTES;
        file[at..at + BYTES].copy_from_slice(&bytes(mutant));
        let faults = verdict(&file);
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
