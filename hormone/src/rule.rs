//! Receptor rules: each is a row of Table 1, as data.
//!
//! A row for one letter reads as in the paper. Where an action goes on over several beats, as a leg's Holding
//! does over all but one of six, one row covers them all: from a first letter to a last one, round the end of
//! the Period if need be. A row may have a condition: then it is only for modules that sense something. While
//! they do, it goes before the row without a condition for the same letter.
//!
//! ```
//! use hormone::action::Action::{Holding, Straight, SwingOver};
//! use hormone::data::Data::{A, B, C, D};
//! use hormone::module_type::ModuleType::{Branch, LeftLeg, RightLeg};
//! use hormone::rule::{LEFT_RIGHT_BACK, received};
//! use hormone::sense::Sense::UpsideDown;
//!
//! received(Branch, A).perform(Straight).send(B, LEFT_RIGHT_BACK); // one row of Table 1
//! received(RightLeg, D).to(B).perform(Holding); // D, and on to A and B
//! received(Branch, A).to(D).perform(Straight).send(B, LEFT_RIGHT_BACK); // A -> B, B -> C, C -> D, D -> A
//! received(LeftLeg, A).given(UpsideDown).perform(SwingOver); // the robot lies on its back
//! ```

use tasks::dock::{Dock, DockSet};

use crate::action::Action;
use crate::case::{Case, Source};
use crate::data::Data;
use crate::module_type::ModuleType;
use crate::sense::Sense;

/// The paper's {b}.
pub const BACK: DockSet = DockSet::of(&[Dock::Back]);
/// The paper's {l,r,b}.
pub const LEFT_RIGHT_BACK: DockSet = DockSet::of(&[Dock::Left, Dock::Right, Dock::Back]);

/// The hormone that a rule sends: `[name, data, docks]` in the paper.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Send {
    /// The data sent for the rule's first letter. For each later letter it is one later too.
    pub data: Data,
    /// The docks it leaves by, if they have a neighbour.
    pub docks: DockSet,
}

/// What a module of one type does at one letter or several in a row. Six bytes of program memory.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Rule {
    pub(crate) case: Case,
    pub(crate) first: Data,
    pub(crate) last: Data,
    pub(crate) action: Action,
    pub(crate) send: Option<Send>,
}

const _: () = assert!(size_of::<Rule>() == 6);

/// A rule for a leader of this type, at the beat of `data` on its local timer.
pub const fn timer(module_type: ModuleType, data: Data) -> Rule {
    Rule::new(module_type, Source::Timer, data)
}

/// A rule for a module of this type that receives `data`.
pub const fn received(module_type: ModuleType, data: Data) -> Rule {
    Rule::new(module_type, Source::Hormone, data)
}

impl Rule {
    const fn new(module_type: ModuleType, source: Source, data: Data) -> Rule {
        let case = Case::new(module_type, source);
        Rule { case, first: data, last: data, action: Action::Straight, send: None }
    }

    /// From the letter named before to `last`, round the end of the Period if that comes before it.
    pub const fn to(self, last: Data) -> Rule {
        Rule { last, ..self }
    }

    /// Only while the module senses this. Every letter needs a rule without a condition, too.
    pub const fn given(self, sense: Sense) -> Rule {
        Rule { case: self.case.given(Some(sense)), ..self }
    }

    /// The action to perform, over as many beats as the rule has letters. Without this it is Straight.
    pub const fn perform(self, action: Action) -> Rule {
        Rule { action, ..self }
    }

    /// What to send at the first letter, and in step with it at the others.
    pub const fn send(self, data: Data, docks: DockSet) -> Rule {
        Rule { send: Some(Send { data, docks }), ..self }
    }

    /// The case that it is for.
    pub const fn case(&self) -> Case {
        self.case
    }

    /// The action to perform.
    pub const fn action(&self) -> Action {
        self.action
    }

    /// Whether `data` is one of the letters.
    pub const fn covers(&self, data: Data, beats: u8) -> bool {
        data.since(self.first, beats) < self.beats(beats)
    }

    /// How many letters there are.
    pub const fn beats(&self, beats: u8) -> u8 {
        self.last.since(self.first, beats) + 1
    }

    /// What to send at `data`.
    pub const fn sends(&self, data: Data, beats: u8) -> Option<Send> {
        match self.send {
            Some(Send { data: first, docks }) => {
                Some(Send { data: first.later(data.since(self.first, beats), beats), docks })
            }
            None => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Data::{A, B, C, D, E, F};

    #[test]
    fn a_run_of_letters_goes_round_the_end_of_the_period() {
        let rule = received(ModuleType::RightLeg, E).to(B);
        let covered: Vec<Data> =
            [A, B, C, D, E, F].into_iter().filter(|&data| rule.covers(data, 6)).collect();
        assert_eq!(covered, [A, B, E, F]);
        assert_eq!(rule.beats(6), 4);
    }

    #[test]
    fn what_is_sent_keeps_step_with_what_came() {
        let rule = received(ModuleType::Branch, A).to(D).send(C, BACK);
        let sent = [A, B, C, D].map(|data| rule.sends(data, 4).unwrap().data);
        assert_eq!(sent, [C, D, A, B]);
        assert_eq!(received(ModuleType::Spine, A).sends(A, 2), None);
    }
}
