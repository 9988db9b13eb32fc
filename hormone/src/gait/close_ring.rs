//! From a chain of six to a ring: all bend until the tail's Back comes to the head's Front, and the tail's dock grasps it.
//!
//! Then the head has a neighbour in front, is a spine like all others, and has them roll.

use super::GaitName::RollingTrack;
use super::Leader;
use crate::action::Action::{Curl, Grasp};
use crate::data::Data::{A, B};
use crate::module_type::ModuleType::{Head, Spine, Tail};
use crate::rule::{BACK, received, timer};

crate::gait! {
    beats: 2,
    beat: 1000,
    leader: Leader::Head,
    once: Spine => RollingTrack,
    rules: [
        timer(Head, A).to(B).perform(Curl).send(A, BACK),
        received(Spine, A).to(B).perform(Curl).send(A, BACK),
        received(Tail, A).to(B).perform(Grasp),
    ],
}
