//! The serpentine: a chain lies on its side, and a wave runs through it in the plane of the ground.
//!
//! Four letters, as the four data values of CONRO's chain: each module is a quarter of the Period ahead of
//! the one before it, and one wave is four modules long. That the body lies on its side, and how far it
//! bends, is our decision.

use super::Leader;
use crate::action::Action::Undulate;
use crate::data::Data::{A, B, D};
use crate::module_type::ModuleType::{Head, Spine, Tail};
use crate::rule::{BACK, received, timer};

crate::gait! {
    beats: 4,
    beat: 300,
    leader: Leader::Head,
    rules: [
        timer(Head, A).to(D).perform(Undulate).send(B, BACK),
        received(Spine, A).to(D).perform(Undulate).send(B, BACK),
        received(Tail, A).to(D).perform(Undulate),
    ],
}
