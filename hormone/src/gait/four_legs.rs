//! The walk on four legs: one leg in the air at a time, three on the ground.
//!
//! The legs of the hind pair are a letter ahead of the front ones, right ones half a Period behind left ones.
//! So they swing in the order left hind, left front, right hind, right front.

use super::Leader;
use crate::action::Action::{Holding, HoldingOver, Straight, Swing, SwingOver};
use crate::data::Data::{A, B, C, D};
use crate::module_type::ModuleType::{Branch, Head, LeftLeg, RightLeg, Spine};
use crate::rule::{BACK, LEFT_RIGHT_BACK, received, timer};
use crate::sense::Sense::UpsideDown;

crate::gait! {
    beats: 4,
    beat: 300,
    leader: Leader::Head,
    rules: [
        timer(Head, A).to(D).perform(Straight).send(A, LEFT_RIGHT_BACK),
        received(Spine, A).to(D).perform(Straight).send(A, BACK),
        received(Branch, A).to(D).perform(Straight).send(B, LEFT_RIGHT_BACK),
        received(LeftLeg, A).perform(Swing),
        received(LeftLeg, A).given(UpsideDown).perform(SwingOver),
        received(LeftLeg, B).to(D).perform(Holding),
        received(LeftLeg, B).to(D).given(UpsideDown).perform(HoldingOver),
        received(RightLeg, C).perform(Swing),
        received(RightLeg, C).given(UpsideDown).perform(SwingOver),
        received(RightLeg, D).to(B).perform(Holding),
        received(RightLeg, D).to(B).given(UpsideDown).perform(HoldingOver),
    ],
}
