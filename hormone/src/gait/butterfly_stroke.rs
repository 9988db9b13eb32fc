//! The butterfly stroke: a body with a pair of arms, which swing forward together and pull the body after
//! them together.
//!
//! All arms of the body, if there are more pairs than one, keep the same stroke.

use super::Leader;
use crate::action::Action::{Holding, Straight, Swing};
use crate::data::Data::{A, B};
use crate::module_type::ModuleType::{Branch, Head, LeftLeg, RightLeg, Spine};
use crate::rule::{BACK, LEFT_RIGHT_BACK, received, timer};

crate::gait! {
    beats: 2,
    beat: 600,
    leader: Leader::Head,
    rules: [
        timer(Head, A).to(B).perform(Straight).send(A, LEFT_RIGHT_BACK),
        received(Spine, A).to(B).perform(Straight).send(A, BACK),
        received(Branch, A).to(B).perform(Straight).send(A, LEFT_RIGHT_BACK),
        received(LeftLeg, A).perform(Swing),
        received(RightLeg, A).perform(Swing),
        received(LeftLeg, B).perform(Holding),
        received(RightLeg, B).perform(Holding),
    ],
}
