//! Gaits: each is a table of rules in a file of its own. A change of shape is a gait too.
//!
//! To add one, write its file with [`gait!`](crate::gait!) and add its line to the registry at the end of
//! this one.

use core::num::NonZeroU16;

use kernel::flash::Flash;
use tasks::dock::DockSet;

use crate::case::Case;
use crate::data::Data;
use crate::module_type::ModuleType;
use crate::rule::Rule;

/// The module that beats the time of a gait by its local timer.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Leader {
    /// The module that is a Head by how it is attached.
    Head,
    /// The module that has no neighbour.
    Alone,
    /// The module that a ring elects, because all its modules are attached alike.
    Elected,
}

/// A change of shape: when a leader's type becomes this one and stays so, the robot walks by another gait.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Once {
    /// The type that the leader becomes.
    pub becomes: ModuleType,
    /// The gait that follows.
    pub then: GaitName,
}

/// A gait, as the file of the gait declares it.
#[derive(Clone, Copy)]
pub struct Gait {
    /// The name of its hormone on the wire, 1 to 11.
    pub name: u8,
    /// Beats in a Period, 1 to 6: how many letters its hormone has.
    pub beats: u8,
    /// The length of a beat in milliseconds. Beats times this is the Period, at most 32 767: a shorter one
    /// walks faster.
    pub beat: NonZeroU16,
    /// The module that beats the time.
    pub leader: Leader,
    /// How a change of shape ends; `None` for other gaits.
    pub once: Option<Once>,
    /// Its rules.
    pub rules: &'static Flash<[Rule]>,
}

/// Declares the gait of a file, `GAIT`, and checks its rules when it is compiled.
///
/// ```
/// mod creeping {
///     use hormone::action::Action::{Straight, Wave};
///     use hormone::data::Data::{A, B};
///     use hormone::gait::Leader;
///     use hormone::module_type::ModuleType::{Head, Spine, Tail};
///     use hormone::rule::{BACK, received, timer};
///
///     hormone::gait! {
///         beats: 2,
///         beat: 500,
///         leader: Leader::Head,
///         rules: [
///             timer(Head, A).to(B).perform(Straight).send(A, BACK),
///             received(Spine, A).to(B).perform(Wave).send(A, BACK),
///             received(Tail, A).to(B).perform(Wave),
///         ],
///     }
/// }
/// assert_eq!(creeping::GAIT.rules.len(), 3);
/// ```
///
/// A table that makes no sense does not compile. A type, dock, letter or action that does not exist:
///
/// ```compile_fail,E0599
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, rule::*};
/// # use hormone::module_type::{ModuleType, ModuleType::*};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [received(ModuleType::Wing, A)] }
/// ```
/// ```compile_fail,E0599
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, module_type::ModuleType::*, rule::*};
/// # use tasks::dock::{Dock, DockSet};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [
///     timer(Head, A).send(A, DockSet::of(&[Dock::Bakc])), received(Spine, A)] }
/// ```
/// ```compile_fail,E0599
/// # use hormone::{action::Action, data::Data::*, gait::Leader, module_type::ModuleType::*, rule::*};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [
///     received(Spine, A).perform(Action::Fly)] }
/// ```
///
/// A letter past the last beat:
///
/// ```compile_fail,E0080
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, module_type::ModuleType::*, rule::*};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [received(Spine, C)] }
/// ```
///
/// Two rules for one case, here B:
///
/// ```compile_fail,E0080
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, module_type::ModuleType::*, rule::*};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [
///     received(LeftLeg, A).to(B).perform(Swing), received(LeftLeg, B).perform(Holding)] }
/// ```
///
/// A sense that does not exist, two rules for one case and sense, and a rule with a condition but none
/// without:
///
/// ```compile_fail,E0599
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, module_type::ModuleType::*};
/// # use hormone::{rule::*, sense::Sense};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [
///     received(LeftLeg, A).given(Sense::Hungry).perform(SwingOver), received(LeftLeg, A).perform(Swing)] }
/// ```
/// ```compile_fail,E0080
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, module_type::ModuleType::*};
/// # use hormone::{rule::*, sense::Sense::*};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [
///     received(LeftLeg, A).to(B).perform(Swing),
///     received(LeftLeg, A).to(B).given(UpsideDown).perform(SwingOver),
///     received(LeftLeg, B).given(UpsideDown).perform(Holding)] }
/// ```
/// ```compile_fail,E0080
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, module_type::ModuleType::*};
/// # use hormone::{rule::*, sense::Sense::*};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [
///     received(LeftLeg, A).perform(Swing),
///     received(LeftLeg, A).to(B).given(UpsideDown).perform(SwingOver)] }
/// ```
///
/// A hormone that no module receives: no left leg has a rule for A.
///
/// ```compile_fail,E0080
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, module_type::ModuleType::*, rule::*};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [
///     timer(Head, A).send(A, LEFT_RIGHT_BACK), received(Spine, A),
///     received(RightLeg, A), received(LeftLeg, B)] }
/// ```
///
/// And a rule for the type that must stay safe:
///
/// ```compile_fail,E0080
/// # use hormone::{action::Action::*, data::Data::*, gait::Leader, module_type::ModuleType::*, rule::*};
/// hormone::gait! { beats: 2, beat: 500, leader: Leader::Head, rules: [received(Other, A).perform(Swing)] }
/// ```
#[macro_export]
macro_rules! gait {
    (
        beats: $beats:literal, beat: $beat:literal, leader: $leader:expr, $(once: $becomes:expr => $next:expr,)?
        rules: [$($rule:expr),* $(,)?] $(,)?
    ) => {
        /// The gait of this file, without a name until the registry gives it one.
        pub const GAIT: $crate::gait::Gait = {
            const RULES: &[$crate::rule::Rule] = &[$($rule),*];
            const _: () = $crate::table::check(RULES, $beats);
            kernel::flash! {
                static TABLE: [$crate::rule::Rule; RULES.len()] = $crate::rows::array(RULES);
            }
            $crate::gait::Gait::new($beats, $beat, $leader, &TABLE)$(.once($becomes, $next))?
        };
    };
}

impl Gait {
    /// See [`gait!`](crate::gait!).
    ///
    /// # Panics
    /// When compiled, if the Period is not between 1 and 32 767 ms.
    pub const fn new(beats: u8, beat: u16, leader: Leader, rules: &'static Flash<[Rule]>) -> Gait {
        assert!(beat as u32 * (beats as u32) < 0x8000, "a Period of at most 32 767 ms");
        let Some(beat) = NonZeroU16::new(beat) else { panic!("a beat of at least 1 ms") };
        Gait { name: 0, beats, beat, leader, once: None, rules }
    }

    /// This gait, which ends in the gait `then` once its leader becomes this type.
    pub const fn once(self, becomes: ModuleType, then: GaitName) -> Gait {
        Gait { once: Some(Once { becomes, then }), ..self }
    }

    /// The gait under this name.
    ///
    /// # Panics
    /// When compiled, if the name is not 1 to 11.
    pub const fn named(self, name: u8) -> Gait {
        assert!(name >= 1 && name <= 11, "names from 12 are those of other hormones");
        Gait { name, ..self }
    }

    /// The rule for this letter, if there is one.
    pub fn rule(&self, case: Case, data: Data) -> Option<Rule> {
        self.rules.iter().find(|rule| rule.case == case && rule.covers(data, self.beats))
    }

    /// The docks by which modules of this type send hormones on, by any rule.
    pub fn ways(&self, module_type: ModuleType) -> DockSet {
        let of_type = self.rules.iter().filter(|rule| rule.case.module_type() == module_type);
        of_type.filter_map(|rule| rule.send).fold(DockSet::EMPTY, |docks, send| docks.union(send.docks))
    }

    /// The Period in milliseconds.
    pub const fn period(&self) -> u16 {
        self.beat.get().wrapping_mul(self.beats as u16)
    }
}

/// Declares the gaits' modules, their names and the table of all.
macro_rules! gaits {
    ($($(#[$attribute:meta])* $name:ident = $number:literal in $file:ident,)*) => {
        $(pub mod $file;)*

        /// The gaits by name.
        #[derive(Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(not(target_arch = "avr"), derive(Debug))]
        #[repr(u8)]
        pub enum GaitName {
            $($(#[$attribute])* $name = $number,)*
        }

        impl GaitName {
            /// The gait with this name on the wire.
            pub const fn from_byte(byte: u8) -> Option<GaitName> {
                match byte {
                    $($number => Some(GaitName::$name),)*
                    _ => None,
                }
            }

            /// The gait itself.
            pub const fn gait(self) -> Gait {
                match self {
                    $(GaitName::$name => $file::GAIT.named($number),)*
                }
            }
        }

        kernel::flash! {
            /// All gaits that a module can walk, in the order of their names, which count from 1.
            pub static GAITS: [Gait; { [$($number),*].len() }] = [$($file::GAIT.named($number)),*];
        }
        const _: () = check_names(&[$($number),*]);
    };
}

/// The names have to be places in the table: a gait is looked up by its name.
const fn check_names(names: &[u8]) {
    let mut place = 0;
    while place < names.len() {
        assert!(names[place] as usize == place + 1, "names count from 1, in the order of the lines");
        place += 1;
    }
}

gaits! {
    /// Any number of legs, on any of the body's modules; the hormone is the paper's CP.
    Centipede = 1 in centipede,
    /// A chain, by a vertical wave.
    Caterpillar = 2 in caterpillar,
    /// A chain on its side, by a wave in the plane of the ground.
    Serpentine = 3 in serpentine,
    /// A ring of six.
    RollingTrack = 4 in rolling_track,
    /// A body with two arms.
    ButterflyStroke = 5 in butterfly_stroke,
    /// Two pairs of legs, one leg in the air at a time.
    FourLegs = 6 in four_legs,
    /// Three pairs of legs, one leg in the air at a time.
    SixLegs = 7 in six_legs,
    /// A chain of six becomes a ring, and rolls.
    CloseRing = 8 in close_ring,
    /// A ring becomes a chain, and walks by the caterpillar.
    OpenRing = 9 in open_ring,
    /// A module alone, by a wave from its back to its front.
    Single = 10 in single,
}
