//! A module alone crawls, and turns.
//!
//! It beats its own time and sends nothing. It has four letters for the sake of a Period of 1.6 s, in which
//! no joint has to turn faster than it can.

use super::Leader;
use crate::action::Action::Inch;
use crate::data::Data::{A, D};
use crate::module_type::ModuleType::Alone;
use crate::rule::timer;

crate::gait! {
    beats: 4,
    beat: 400,
    leader: Leader::Alone,
    rules: [timer(Alone, A).to(D).perform(Inch)],
}
