//! From a ring to a chain: all bend alike, and then the elected leader lets go of its neighbour in front.
//!
//! Then it has no neighbour in front, is the head, and has the robot walk by the caterpillar.

use super::GaitName::Caterpillar;
use super::Leader;
use crate::action::Action::{Curl, Release};
use crate::data::Data::{A, B};
use crate::module_type::ModuleType::{Head, Spine};
use crate::rule::{BACK, received, timer};

crate::gait! {
    beats: 2,
    beat: 1000,
    leader: Leader::Elected,
    once: Head => Caterpillar,
    rules: [
        timer(Spine, A).perform(Release).send(A, BACK),
        timer(Spine, B).perform(Curl).send(B, BACK),
        received(Spine, A).to(B).perform(Curl).send(A, BACK),
    ],
}
