use simavr_harness::{Controller, RobotBuilder};
use std::collections::BTreeMap;
use superbot_tests_simavr::chain::Chain;
use superbot_tests_simavr::stacks::Stacks;
use superbot_tests_simavr::{MILLISECOND, firmware};

#[test]
fn stacks() {
    let mut robot = RobotBuilder::chain(firmware(), 5).seed(1).build().unwrap();
    let mut painted = Vec::new();
    for module in 0..5 {
        for controller in Controller::ALL {
            let mcu = robot.module_mut(module).unwrap().mcu_mut(controller);
            painted.push((module, controller, Stacks::paint(mcu)));
        }
    }
    let mut chain = Chain::of_robot(robot, 1);
    chain.lose_frames(0.3);
    chain.run(20_000 * MILLISECOND);
    let mut least = BTreeMap::new();
    for (module, controller, stacks) in &painted {
        let mcu = chain.robot().module(*module).unwrap().mcu(*controller);
        for (stack, unused) in stacks.unused(mcu) {
            let least = least.entry((*controller, stack.name.clone(), stack.size)).or_insert(unused);
            *least = unused.min(*least);
        }
    }
    println!("{:?}", chain.robot().crashes().collect::<Vec<_>>());
    for ((controller, name, size), unused) in least {
        println!("{controller:?} {name:15} {:4} of {size} used, {unused} left", size - unused);
    }
}
