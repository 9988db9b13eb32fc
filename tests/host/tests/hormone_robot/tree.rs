//! Robots of any shape without a loop: they know themselves, even if nonsense arrives at their docks, and a
//! hormone comes to an end.

use std::num::NonZeroU16;

use hormone::gait::Gait;
use hormone::gait::GaitName::Centipede;
use hormone::topology::{LOSSY_TIMEOUT, UNKNOWN_FOR};
use proptest::prelude::*;
use tasks::dock::Dock;

use crate::robot::Robot;

/// A beat so long that no head beats during a test.
const NEVER: NonZeroU16 = NonZeroU16::new(16_383).unwrap();

/// Attaches each module to an earlier one. `choices` selects that module and the docks.
fn tree(choices: &[(usize, usize, usize)], seed: u64) -> Robot {
    let mut robot = Robot::new(Gait { beat: NEVER, ..Centipede.gait() }, choices.len() + 1, seed);
    for (number, &(parent, parent_dock, dock)) in choices.iter().enumerate() {
        let new = number + 1;
        let free: Vec<(usize, Dock)> = (0..new)
            .flat_map(|module| Dock::ALL.map(|dock| (parent.wrapping_add(module) % new, dock)))
            .filter(|&port| robot.wire(port).is_none())
            .collect();
        robot.attach(free[parent_dock % free.len().min(6)], (new, Dock::ALL[dock % 6]));
    }
    robot
}

fn shapes() -> impl Strategy<Value = Vec<(usize, usize, usize)>> {
    // Half of the docks are Back to Front, so that the paper's types occur too.
    let docks = prop_oneof![Just((1, 0)), (0..6_usize, 0..6_usize)];
    prop::collection::vec(
        (any::<usize>(), docks).prop_map(|(parent, (one, other))| (parent, one, other)),
        1..12,
    )
}

/// What may come in at a dock of a module: a payload for HORMONE and one for AC_RECV, and the time until the
/// next, in milliseconds.
fn nonsense() -> impl Strategy<Value = (usize, usize, Vec<u8>, u8, u32)> {
    // Beats, orders, standing orders and tokens among them.
    let payload = prop::collection::vec(any::<u8>(), 2..=4);
    (any::<usize>(), 0..6_usize, payload, any::<u8>(), 0..20_u32)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn a_tree_knows_itself_also_after_modules_come_and_go(
        shape in shapes(),
        seed: u64,
        changes in prop::collection::vec((any::<usize>(), 0..6_usize), 0..6),
    ) {
        let mut robot = tree(&shape, seed);
        robot.longest_delay = 5;
        prop_assert!(robot.discover(150).is_some());
        robot.run(2 * u32::from(UNKNOWN_FOR));
        for (module, dock) in changes {
            let port = (module % robot.len(), Dock::ALL[dock]);
            let other = robot.wire(port);
            robot.detach(port);
            prop_assert!(robot.discover(300).is_some());
            if let Some(other) = other {
                robot.attach(port, other);
                prop_assert!(robot.discover(150).is_some());
                robot.run(2 * u32::from(UNKNOWN_FOR));
            }
        }
    }

    #[test]
    fn a_hormone_in_a_tree_ends(
        shape in shapes(),
        seed: u64,
        module: usize,
        dock in 0..6_usize,
        data in 0..2_u8,
    ) {
        let mut robot = tree(&shape, seed);
        robot.discover(150);
        let count = robot.len();
        robot.inject((module % count, Dock::ALL[dock]), &[0x10 | data, 0]);
        // Down the tree and back once at most, a millisecond a hop.
        robot.run(2 * count as u32);
        prop_assert_eq!(robot.hormones_under_way(), 0);
        for module in 0..count {
            prop_assert!(robot.hormones_received(module).len() <= 2);
        }
    }

    #[test]
    fn nonsense_from_a_neighbour_is_survived_and_forgotten(
        shape in shapes(),
        seed: u64,
        noise in prop::collection::vec(nonsense(), 0..200),
    ) {
        let mut robot = tree(&shape, seed);
        for (module, dock, payload, probe, pause) in noise {
            let port = (module % robot.len(), Dock::ALL[dock]);
            robot.inject(port, &payload);
            robot.inject_probe(port, probe);
            robot.run(pause);
        }
        // Nonsense with pauses looks like a neighbour with a lossy link, and such a link gets more time.
        prop_assert!(robot.discover(u32::from(LOSSY_TIMEOUT) + 50).is_some());
    }
}
