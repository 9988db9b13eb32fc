//! The walk on six legs: one leg in the air at a time, a wave along each side from the hind leg to the front
//! one.
//!
//! Each pair is two letters ahead of the one before it, right legs half a Period behind left ones. For the
//! faster walk on three legs at a time there is the centipede.

use super::Leader;
use crate::action::Action::{Holding, HoldingOver, Straight, Swing, SwingOver};
use crate::data::Data::{A, B, C, D, E, F};
use crate::module_type::ModuleType::{Branch, Head, LeftLeg, RightLeg, Spine};
use crate::rule::{BACK, LEFT_RIGHT_BACK, received, timer};
use crate::sense::Sense::UpsideDown;

crate::gait! {
    beats: 6,
    beat: 250,
    leader: Leader::Head,
    rules: [
        timer(Head, A).to(F).perform(Straight).send(A, LEFT_RIGHT_BACK),
        received(Spine, A).to(F).perform(Straight).send(A, BACK),
        received(Branch, A).to(F).perform(Straight).send(C, LEFT_RIGHT_BACK),
        received(LeftLeg, A).perform(Swing),
        received(LeftLeg, A).given(UpsideDown).perform(SwingOver),
        received(LeftLeg, B).to(F).perform(Holding),
        received(LeftLeg, B).to(F).given(UpsideDown).perform(HoldingOver),
        received(RightLeg, D).perform(Swing),
        received(RightLeg, D).given(UpsideDown).perform(SwingOver),
        received(RightLeg, E).to(C).perform(Holding),
        received(RightLeg, E).to(C).given(UpsideDown).perform(HoldingOver),
    ],
}
