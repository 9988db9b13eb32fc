//! How much of its stack each task needs.

use std::collections::BTreeMap;

use simavr_harness::{Controller, Face, RobotBuilder};
use superbot_tests_simavr::chain::Chain;
use superbot_tests_simavr::firmware;
use superbot_tests_simavr::stacks::Stacks;
use tasks::dock::Dock;

/// What must never have been used, in bytes: an interrupt lays this much on the stack of the task that it strikes, and
/// need not have struck at the deepest point.
const SPARE: u16 = 35;

/// A chain of five, and at the one in the middle another two: so that all four links of a module are in use.
const ATTACHMENTS: [((usize, Dock), (usize, Dock)); 6] = [
    ((0, Dock::Back), (1, Dock::Front)),
    ((1, Dock::Back), (2, Dock::Front)),
    ((2, Dock::Back), (3, Dock::Front)),
    ((3, Dock::Back), (4, Dock::Front)),
    ((2, Dock::Left), (5, Dock::Back)),
    ((2, Dock::Up), (6, Dock::Back)),
];

const MODULES: usize = 7;

#[test]
fn every_stack_has_room_for_one_more_interrupt() {
    let builder = RobotBuilder::new(firmware(), MODULES).seed(1);
    let builder = ATTACHMENTS.into_iter().fold(builder, |builder, (one, other)| {
        let [one, other] = [one, other].map(|(module, dock)| Face { module, dock });
        builder.attach(one, other)
    });
    let mut robot = builder.build().expect("the robot can be built");
    let mcus = (0..MODULES).flat_map(|module| Controller::ALL.map(|mcu| (module, mcu)));
    let painted: Vec<_> = mcus
        .map(|(module, mcu)| {
            let stacks = Stacks::paint(robot.module_mut(module).expect("the module is there").mcu_mut(mcu));
            (module, mcu, stacks)
        })
        .collect();

    let mut chain = Chain::of_robot(robot, 2);
    chain.lose_frames(0.3);
    chain.run(20 * u64::from(simavr_harness::CLOCK_HZ));
    chain.assert_alive();

    let mut least = BTreeMap::new();
    for (module, controller, stacks) in &painted {
        let mcu = chain.robot().module(*module).expect("the module is there").mcu(*controller);
        for (stack, unused) in stacks.unused(mcu) {
            let least = least.entry((*controller, stack)).or_insert(unused);
            *least = unused.min(*least);
        }
    }
    println!("MCU     stack           bytes  used  left");
    for ((controller, stack), unused) in &least {
        let (name, size) = (&stack.name, stack.size);
        println!("{:7} {name:15} {size:5} {:5} {unused:5}", format!("{controller:?}"), size - unused);
    }
    let short: Vec<_> = least.into_iter().filter(|&(_, unused)| unused < SPARE).collect();
    assert!(short.is_empty(), "fewer than {SPARE} bytes left: {short:?}");
}
