//! The rolling track: a ring of six modules, each one's Back at the next one's Front.
//!
//! All are attached alike and none has a number, so a leader is [elected](crate::election). Each module is a
//! third of the Period ahead of the one before it: two waves stand in the ring, opposite each other, and run
//! round it. A step of 30 degrees takes half a second, because no joint is told to turn faster than 60
//! degrees a second.

use super::Leader;
use crate::action::Action::Roll;
use crate::data::Data::{A, B, C};
use crate::module_type::ModuleType::Spine;
use crate::rule::{BACK, received, timer};

crate::gait! {
    beats: 3,
    beat: 1000,
    leader: Leader::Elected,
    rules: [
        timer(Spine, A).to(C).perform(Roll).send(B, BACK),
        received(Spine, A).to(C).perform(Roll).send(B, BACK),
    ],
}
