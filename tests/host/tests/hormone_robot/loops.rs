//! A loop of modules without a leader: the beat that was on its way when the loop closed may continue, but it
//! does not race round.

use hormone::gait::GaitName::{Caterpillar, Centipede, Serpentine};
use tasks::dock::Dock::{Back, Front, Left, Right};

use crate::robot::{Robot, Segment};

/// Two beats each second.
const BEATS: usize = 20;
const TEN_SECONDS: u32 = 10_000;

/// The most hormones that any module receives in ten seconds.
fn most_received(robot: &mut Robot) -> usize {
    let received =
        |robot: &Robot| (0..robot.len()).map(|at| robot.hormones_received(at).len()).collect::<Vec<_>>();
    let before = received(robot);
    robot.run(TEN_SECONDS);
    received(robot).iter().zip(before).map(|(now, before)| now - before).max().unwrap_or(0)
}

#[test]
fn a_walking_chain_whose_ends_are_joined_does_not_race() {
    let gaits = [Centipede, Caterpillar, Serpentine].map(|name| name.gait());
    for (gait, modules) in
        gaits.into_iter().flat_map(|gait| [2, 3, 6, 12, 13, 40].map(|modules| (gait, modules)))
    {
        for seed in 0..5 {
            let mut robot = Robot::with_body(gait, &vec![Segment::Spine; modules - 2], seed);
            robot.longest_delay = 3;
            robot.discover(150).unwrap();
            robot.run(3_000 + 97 * seed as u32);
            robot.attach((modules - 1, Back), (0, Front));
            robot.discover(150).unwrap();
            let most = most_received(&mut robot);
            let beats = (TEN_SECONDS / u32::from(gait.beat.get())) as usize;
            // A beat may be an eighth shorter.
            assert!(
                most <= 9 * beats / 4,
                "{most} in a ring of {modules} by gait {}, seed {seed}",
                gait.name
            );
        }
    }
}

#[test]
fn a_loop_of_modules_of_no_known_type_does_not_race_with_a_head_or_without() {
    for seed in 0..10 {
        let mut robot = Robot::new(Centipede.gait(), 4, seed);
        robot.longest_delay = 3;
        for module in 0..3 {
            robot.attach((module, Right), ((module + 1) % 3, Left));
        }
        robot.attach((3, Back), (0, Front));
        robot.discover(150).unwrap();
        robot.run(3_000 + 97 * seed as u32);
        // Modules 1 and 2 get each beat from both sides.
        let most = most_received(&mut robot);
        assert!(most.abs_diff(2 * BEATS) <= 2, "{most} with a head, seed {seed}");
        robot.detach((3, Back));
        let most = most_received(&mut robot);
        assert!(most <= 2 * BEATS, "{most} without, seed {seed}");
    }
}
