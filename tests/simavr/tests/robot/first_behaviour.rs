//! The behaviour that docs/first-behaviour.md adds, in the images that `./x tutorial` makes of that page: on
//! the master, and on the slave.

use std::sync::Arc;

use hormone::module_type::ModuleType;
use simavr_harness::{CLOCK_HZ, Controller, Engine, Face, Image, Images, RobotBuilder};
use simulation::{Change, Robot as _, Shape};
use superbot_tests_simavr::images;
use tasks::dock::Dock;

const MODULES: usize = 5;

/// The number of modules ahead of each module, as the module has found it.
fn places(engine: &Engine, controller: Controller) -> Vec<u8> {
    let place = |module| {
        let mcu = engine.robot().module(module).expect("the module is there").mcu(controller);
        mcu.read_symbol("MODULES_AHEAD").expect("the image has the symbol")[0]
    };
    (0..MODULES).map(place).collect()
}

#[test]
fn a_chain_counts_itself_and_counts_anew_when_it_comes_apart() {
    runs("tutorial", Controller::Master);
}

#[test]
fn the_task_may_move_to_the_other_mcu() {
    runs("tutorial-slave", Controller::Slave);
}

/// Runs images with the behaviour on this MCU.
fn runs(images_of: &str, controller: Controller) {
    let [master, slave] = ["firmware-master", "firmware-slave"].map(|name| {
        let path = images().join(images_of).join(name).with_extension("elf");
        Arc::new(Image::load(path).unwrap_or_else(|error| panic!("{error}; ./x tutorial makes it")))
    });
    let wiring = Shape::Chain.wiring(MODULES).expect("there are such chains");
    let robot = RobotBuilder::wired(Images { master, slave }, &wiring).build().expect("it can be built");
    let mut engine = Engine::new(robot, 2);
    let second = u64::from(CLOCK_HZ);

    // A module sends from its start on, so the count reaches the last module after at most a period for each.
    engine.run_until(MODULES as u64 * second);
    assert_eq!(places(&engine, controller), [0, 1, 2, 3, 4]);

    engine.change(&Change::Detach(Face { module: 2, dock: Dock::Back })).expect("they are attached");
    engine.run_until(2 * MODULES as u64 * second);
    assert_eq!(places(&engine, controller), [0, 1, 2, 0, 1]);
    // The other behaviours go on.
    let types = [2, 3].map(|module| engine.status(module).map(|status| status.module_type));
    assert_eq!(types, [Some(ModuleType::Tail), Some(ModuleType::Head)]);
}
