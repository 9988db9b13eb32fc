//! No stack is ever used beyond the bound that was computed for it.

use std::path::{Path, PathBuf};

use simavr_harness::{CLOCK_HZ, Controller, Face, Part, RobotBuilder};
use simulation::Change;
use superbot_tests_simavr::chain::Chain;
use superbot_tests_simavr::stacks::{paint, stacks};
use superbot_tests_simavr::target::{TARGETS, Target};
use superbot_tests_simavr::{firmware, images};
use tasks::dock::Dock;

/// A chain of five, with two more modules at the middle one, so that four links of a module are in use.
const ATTACHMENTS: [((usize, Dock), (usize, Dock)); 6] = [
    ((0, Dock::Back), (1, Dock::Front)),
    ((1, Dock::Back), (2, Dock::Front)),
    ((2, Dock::Back), (3, Dock::Front)),
    ((3, Dock::Back), (4, Dock::Front)),
    ((2, Dock::Left), (5, Dock::Back)),
    ((2, Dock::Up), (6, Dock::Back)),
];

const MODULES: usize = 7;

const SECOND: u64 = CLOCK_HZ as u64;

#[test]
fn of_the_robot() {
    let builder = RobotBuilder::new(firmware(), MODULES).seed(1);
    let builder = ATTACHMENTS.into_iter().fold(builder, |builder, (one, other)| {
        let [one, other] = [one, other].map(|(module, dock)| Face { module, dock });
        builder.attach(one, other)
    });
    let mut robot = builder.build().expect("the robot can be built");
    let mcus = [(Controller::Master, "firmware-master"), (Controller::Slave, "firmware-slave")];
    let stacks = mcus.map(|(controller, name)| {
        let image = images().join(name).with_extension("elf");
        (controller, stacks(Part::ATMEGA128, &image, Some(&notes(name))))
    });
    // The stacks of the tasks, and the kernel's.
    assert_eq!(stacks.each_ref().map(|(_, stacks)| stacks.len()), [12, 10]);
    for module in 0..MODULES {
        for (controller, stacks) in &stacks {
            paint(robot.module_mut(module).expect("the module is there").mcu_mut(*controller), stacks);
        }
    }

    for (module, dock) in [(2, Dock::Down), (3, Dock::Right)] {
        robot.change(&Change::Console(Face { module, dock })).expect("the dock is free");
    }

    let mut chain = Chain::of_robot(robot, 2);
    chain.lose_frames(0.3);
    chain.run(20 * SECOND);
    chain.lose_frames(0.0);
    chain.run(SECOND / 2);
    chain.assert_right("after 20 s with losses");

    println!("MCU     stack           bytes  bound  used");
    let mut beyond = Vec::new();
    for (controller, stacks) in &stacks {
        for stack in stacks {
            let mcus = (0..MODULES).filter_map(|module| Some(chain.robot().module(module)?.mcu(*controller)));
            let used = mcus.map(|mcu| stack.used(mcu)).max().unwrap_or_default();
            let (size, bound) = (stack.bound.size, stack.bound.needs());
            println!("{:7} {:15} {size:5} {bound:6} {used:5}", format!("{controller:?}"), stack.name);
            assert!(
                bound < size.into(),
                "{}: with no byte to spare, use beyond the bound would not show",
                stack.name
            );
            if used > bound {
                beyond.push((controller, &stack.name, used, bound));
            }
        }
    }
    assert!(beyond.is_empty(), "used beyond the bound: {beyond:?}");
}

/// The file of notes for `stack-bound` about the images of a package.
fn notes(package: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(package).join("stacks.txt")
}

/// The stacks of test images are generous: use beyond a bound would show.
#[test]
fn of_the_test_images() {
    for target in TARGETS {
        assert!(exact_bounds(target) > 0, "no bound is reached: they are far too large");
    }
}

/// The image that overruns a stack on purpose.
const OVERRUN: [&str; 1] = ["stack"];

/// Runs the images of an MCU, and returns how many stacks were used to their last byte.
fn exact_bounds(target: &Target) -> usize {
    let mut exact = 0;
    for entry in std::fs::read_dir(target.images()).expect("there are test images: ./x test builds them") {
        let path = entry.expect("the directory can be read").path();
        if path.extension().is_none_or(|extension| extension != "elf") {
            continue; // a folder of other images
        }
        let name = path.file_stem().and_then(|name| name.to_str()).expect("the images have plain names");
        let stacks = stacks(target.part, &path, Some(&notes("tests/images")));
        let mut mcu = target.mcu(target.image(name));
        paint(&mut mcu, &stacks);
        mcu.run_to_end(2 * SECOND);
        for stack in &stacks {
            let (used, bound) = (stack.used(&mcu), stack.bound.needs());
            println!("{:11} {name:20} {:15} {bound:6} {used:5}", target.part.name, stack.name);
            assert!(used <= bound, "{}: {used} bytes used of {}", path.display(), stack.bound);
            let is_enough = bound <= stack.bound.size.into() || OVERRUN.contains(&name);
            assert!(is_enough, "{}: too small a stack: {}", path.display(), stack.bound);
            exact += usize::from(used == bound);
        }
    }
    exact
}
