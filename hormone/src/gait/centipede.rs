//! The centipede (paper, section 7 and Table 1).
//!
//! The head beats A and B; spines pass the beat on, branches alternate it for what lies behind them,
//! and of a branch's two legs one swings while the other holds. The tail has no rule.
//!
//! Table 1 has the spine answer B to A. We build what the text says, that the hormone "propagates
//! through the spine modules as it is": by the table's row every leg behind the first spine would get
//! the same data twice a Period and never alternate.

use core::num::NonZeroU16;

use tasks::dock::{Dock, DockSet};

use crate::action::Action::{Holding, Straight, Swing};
use crate::hormone::{Data, Hormone, HormoneName};
use crate::local_timer::Phase;
use crate::module_type::ModuleType::{Branch, Head, LeftLeg, RightLeg, Spine};
use crate::rule::Trigger::{Received, Timer};
use crate::rule::{Outgoing, Rule};

/// Milliseconds from one A to the next. Sets the pace: a shorter Period walks faster.
pub const PERIOD: NonZeroU16 = NonZeroU16::new(1000).unwrap();

const A: Hormone = Hormone { name: HormoneName::CP, data: Data::A };
const B: Hormone = Hormone { name: HormoneName::CP, data: Data::B };

const BACK: DockSet = DockSet::of(&[Dock::Back]);
const LEFT_RIGHT_BACK: DockSet = DockSet::of(&[Dock::Left, Dock::Right, Dock::Back]);

const fn send(hormone: Hormone, docks: DockSet) -> Option<Outgoing> {
    Some(Outgoing { hormone, docks })
}

kernel::flash! {
    /// Table 1, by the text.
    pub static RULES: [Rule; 10] = [
        Rule::new(Head, Timer(Phase::START), Straight, send(A, LEFT_RIGHT_BACK)),
        Rule::new(Head, Timer(Phase::HALF), Straight, send(B, LEFT_RIGHT_BACK)),
        Rule::new(Spine, Received(A), Straight, send(A, BACK)),
        Rule::new(Spine, Received(B), Straight, send(B, BACK)),
        Rule::new(Branch, Received(A), Straight, send(B, LEFT_RIGHT_BACK)),
        Rule::new(Branch, Received(B), Straight, send(A, LEFT_RIGHT_BACK)),
        Rule::new(LeftLeg, Received(A), Swing, None),
        Rule::new(RightLeg, Received(A), Holding, None),
        Rule::new(LeftLeg, Received(B), Holding, None),
        Rule::new(RightLeg, Received(B), Swing, None),
    ];
}
