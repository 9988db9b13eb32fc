//! From a chain of six to a ring: all bend until the tail's Back comes to the head's Front. Then the tail's
//! dock approaches the head's with the joints of its module, and latches; if it does not come near enough, it
//! stays where it came nearest, and the head's dock approaches it in the same way. Each of the three steps
//! takes two beats. In the next Period both searches go on: the joints are told nothing new, and stay where a
//! search has left them.
//!
//! The tail begins its search at one beat only. A tail that was reset meanwhile, and began later, would latch
//! together with the head; and if the hooks of both missed, each would take the other for its neighbour.
//!
//! Then the head has a neighbour in front, is a spine like all others, and has them roll.

use super::GaitName::RollingTrack;
use super::Leader;
use crate::action::Action::{Curl, Grasp, Reach};
use crate::data::Data::{A, B, C, D, E, F};
use crate::module_type::ModuleType::{Head, Spine, Tail};
use crate::rule::{BACK, received, timer};

crate::gait! {
    beats: 6,
    beat: 1000,
    leader: Leader::Head,
    once: Spine => RollingTrack,
    rules: [
        timer(Head, A).to(D).perform(Curl).send(A, BACK),
        timer(Head, E).to(F).perform(Reach).send(E, BACK),
        received(Spine, A).to(F).perform(Curl).send(A, BACK),
        received(Tail, A).to(B).perform(Curl),
        received(Tail, C).perform(Grasp),
        received(Tail, D).to(F).perform(Curl),
    ],
}
