//! The gait by the rules of the paper's text, and how the rules of its printed table fail.

use hormone::action::Action;
use hormone::data::Data;
use hormone::gait::GaitName::Centipede;

use crate::robot::{Robot, Segment, hundred_modules};

#[test]
fn a_chain_of_five_passes_the_beat_to_its_tail() {
    for longest_delay in 1..=10 {
        let mut robot = Robot::with_body(Centipede.gait(), &[Segment::Spine; 3], longest_delay.into());
        robot.longest_delay = longest_delay;
        robot.discover(150).unwrap();
        let known = robot.now;
        robot.run(5_000);
        assert_eq!(robot.gait_violations(known, robot.now), 0);
        let at_the_tail: Vec<Data> =
            robot.hormones_received(4).iter().filter(|beat| beat.at > known).map(|beat| beat.data).collect();
        assert_eq!(at_the_tail.len(), 10);
        assert!(at_the_tail.windows(2).all(|pair| pair[0] != pair[1]), "{at_the_tail:?}");
    }
}

#[test]
fn a_hundred_modules_walk() {
    let alternating = [[Segment::Branch, Segment::Spine]; 24].concat();
    let branches_first = [[Segment::Branch; 24].as_slice(), &[Segment::Spine; 26]].concat();
    let spines_first = [[Segment::Spine; 26].as_slice(), &[Segment::Branch; 24]].concat();
    for body in [alternating, branches_first, spines_first, hundred_modules(7), hundred_modules(8)] {
        let mut robot = Robot::with_body(Centipede.gait(), &body, 2);
        robot.longest_delay = 5;
        robot.frame_loss = 5;
        robot.discover(1_000).unwrap();
        let known = robot.now;
        robot.run(5_000);
        assert_eq!(robot.gait_violations(known, robot.now), 0);
    }
}

/// Table 1 as printed: its spine answers A with B.
mod as_printed {
    use hormone::action::Action::{Holding, Straight, Swing};
    use hormone::data::Data::{A, B};
    use hormone::gait::Leader;
    use hormone::module_type::ModuleType::{Branch, Head, LeftLeg, RightLeg, Spine};
    use hormone::rule::{BACK, LEFT_RIGHT_BACK, received, timer};

    hormone::gait! {
        beats: 2,
        beat: 500,
        leader: Leader::Head,
        rules: [
            timer(Head, A).perform(Straight).send(A, LEFT_RIGHT_BACK),
            timer(Head, B).perform(Straight).send(B, LEFT_RIGHT_BACK),
            received(Spine, A).perform(Straight).send(B, BACK),
            received(Spine, B).perform(Straight).send(B, BACK),
            received(Branch, A).perform(Straight).send(B, LEFT_RIGHT_BACK),
            received(Branch, B).perform(Straight).send(A, LEFT_RIGHT_BACK),
            received(LeftLeg, A).perform(Swing),
            received(RightLeg, A).perform(Holding),
            received(LeftLeg, B).perform(Holding),
            received(RightLeg, B).perform(Swing),
        ],
    }
}

#[test]
fn by_the_printed_table_legs_behind_a_spine_never_alternate() {
    for (body, walks) in
        [(&[Segment::Branch, Segment::Spine], true), (&[Segment::Spine, Segment::Branch], false)]
    {
        let mut robot = Robot::with_body(as_printed::GAIT.named(1), body, 1);
        robot.discover(150).unwrap();
        let known = robot.now;
        robot.run(5_000);
        assert_eq!(robot.gait_violations(known, robot.now) == 0, walks, "{body:?}");
        // The index of a leg follows that of its branch, which follows the head and, if the spine is first,
        // the spine.
        let left_leg = if body[0] == Segment::Branch { 2 } else { 3 };
        let actions: Vec<Action> =
            robot.acts(left_leg).iter().filter(|act| act.at > known).map(|act| act.action).collect();
        let alternates = actions.windows(2).all(|pair| pair[0] != pair[1]);
        let stuck = actions.windows(2).all(|pair| pair[0] == pair[1]);
        assert_eq!([alternates, stuck], [walks, !walks], "{actions:?}");
    }
}
