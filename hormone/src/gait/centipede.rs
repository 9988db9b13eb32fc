//! The centipede (paper, section 7 and Table 1).
//!
//! The head beats A and B; spines pass the beat on, branches alternate it for what lies behind them,
//! and of a branch's two legs one swings while the other holds. The tail has no rule.
//!
//! Table 1 has the spine answer B to A. We build what the text says, that the hormone "propagates
//! through the spine modules as it is": by the table's row every leg behind the first spine would get
//! the same data twice a Period and never alternate.
//!
//! A leg whose accelerometer says that it lies on its back lifts its foot the other way, so a robot that is
//! turned over walks on. No other module tells it to. The hip moves as before, and ahead stays where it was.

use super::Leader;
use crate::action::Action::{Holding, HoldingOver, Straight, Swing, SwingOver};
use crate::data::Data::{A, B};
use crate::module_type::ModuleType::{Branch, Head, LeftLeg, RightLeg, Spine};
use crate::rule::{BACK, LEFT_RIGHT_BACK, received, timer};
use crate::sense::Sense::UpsideDown;

crate::gait! {
    beats: 2,
    beat: 500,
    leader: Leader::Head,
    rules: [
        timer(Head, A).perform(Straight).send(A, LEFT_RIGHT_BACK),
        timer(Head, B).perform(Straight).send(B, LEFT_RIGHT_BACK),
        received(Spine, A).perform(Straight).send(A, BACK),
        received(Spine, B).perform(Straight).send(B, BACK),
        received(Branch, A).perform(Straight).send(B, LEFT_RIGHT_BACK),
        received(Branch, B).perform(Straight).send(A, LEFT_RIGHT_BACK),
        received(LeftLeg, A).perform(Swing),
        received(LeftLeg, A).given(UpsideDown).perform(SwingOver),
        received(RightLeg, A).perform(Holding),
        received(RightLeg, A).given(UpsideDown).perform(HoldingOver),
        received(LeftLeg, B).perform(Holding),
        received(LeftLeg, B).given(UpsideDown).perform(HoldingOver),
        received(RightLeg, B).perform(Swing),
        received(RightLeg, B).given(UpsideDown).perform(SwingOver),
    ],
}
