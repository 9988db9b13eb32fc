//! The caterpillar: a vertical wave runs through a chain (the laboratory's simulator ReMod3D).
//!
//! There the head counts 20 steps, and the module n places behind it is 4 n steps ahead. Five letters are
//! four steps apart: each module is one letter ahead of the one before it, and one wave is five modules long.

use super::Leader;
use crate::action::Action::Wave;
use crate::data::Data::{A, B, E};
use crate::module_type::ModuleType::{Head, Spine, Tail};
use crate::rule::{BACK, received, timer};

crate::gait! {
    beats: 5,
    beat: 200,
    leader: Leader::Head,
    rules: [
        timer(Head, A).to(E).perform(Wave).send(B, BACK),
        received(Spine, A).to(E).perform(Wave).send(B, BACK),
        received(Tail, A).to(E).perform(Wave),
    ],
}
