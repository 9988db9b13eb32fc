//! From a chain of six to a ring: all bend until the tail's Back comes to the head's Front, and the tail's
//! dock grasps it. For bending there are two beats at least, for grasping three: a search and the latch. What
//! was in vain is tried again in the next Period.
//!
//! Then the head has a neighbour in front, is a spine like all others, and has them roll.

use super::GaitName::RollingTrack;
use super::Leader;
use crate::action::Action::{Curl, Grasp};
use crate::data::Data::{A, C, D, F};
use crate::module_type::ModuleType::{Head, Spine, Tail};
use crate::rule::{BACK, received, timer};

crate::gait! {
    beats: 6,
    beat: 1000,
    leader: Leader::Head,
    once: Spine => RollingTrack,
    rules: [
        timer(Head, A).to(F).perform(Curl).send(A, BACK),
        received(Spine, A).to(F).perform(Curl).send(A, BACK),
        received(Tail, A).to(C).perform(Curl),
        received(Tail, D).to(F).perform(Grasp),
    ],
}
