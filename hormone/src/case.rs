//! The case that a rule is for: one byte, by which HORMONE looks the rule up.
//!
//! ```text
//!   1 + sense, 0 without a condition (7..4) | source (3) | module type (2..0)
//! ```

use crate::module_type::ModuleType;
use crate::sense::Sense;

/// The source of the letter that a rule answers to.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(u8)]
pub enum Source {
    /// The local timer of a leader has come to the letter's beat: A at 0, B one beat later.
    Timer,
    /// A hormone brings it.
    Hormone,
}

/// A type, the source of a letter, and what the module has to sense, if anything.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Case(u8);

const SOURCE: u8 = 1 << 3;
const SENSE: u32 = 4;

const _: () = assert!(Sense::ALL.len() < 16, "a case has four bits for them");

impl Case {
    /// A case without a condition.
    pub const fn new(module_type: ModuleType, source: Source) -> Case {
        Case((source as u8) << 3 | module_type as u8)
    }

    /// This case with another condition, or with none.
    pub const fn given(self, sense: Option<Sense>) -> Case {
        let code = match sense {
            Some(sense) => 1 + sense as u8,
            None => 0,
        };
        Case(code << SENSE | self.0 & 0x0F)
    }

    /// The type.
    pub const fn module_type(self) -> ModuleType {
        match ModuleType::from_byte(self.0 & 7) {
            Some(module_type) => module_type,
            None => ModuleType::Other,
        }
    }

    /// Whether a hormone brings the letter.
    pub const fn is_received(self) -> bool {
        self.0 & SOURCE != 0
    }

    /// Whether both are the same but for the source.
    pub const fn is_like(self, other: Case) -> bool {
        self.0 & !SOURCE == other.0 & !SOURCE
    }

    /// Whether both are the same. Works in constants, where `==` does not.
    pub const fn is(self, other: Case) -> bool {
        self.0 == other.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_a_byte_of_its_own_that_says_what_it_is() {
        let mut bytes = std::collections::HashSet::new();
        for module_type in (0..=u8::MAX).filter_map(ModuleType::from_byte) {
            for source in [Source::Timer, Source::Hormone] {
                let plain = Case::new(module_type, source);
                for sense in [None].into_iter().chain(Sense::ALL.map(Some)) {
                    let case = plain.given(sense);
                    assert!(bytes.insert(case.0));
                    assert_eq!(case.module_type(), module_type);
                    assert_eq!(case.is_received(), source == Source::Hormone);
                    assert_eq!(case.given(None), plain);
                    assert!(case.is_like(Case::new(module_type, Source::Timer).given(sense)));
                    assert_eq!(case.is_like(plain), sense.is_none());
                }
            }
        }
    }
}
