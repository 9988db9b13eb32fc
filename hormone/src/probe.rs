//! The probe: what AC_SEND tells the neighbour that may sit at a dock.
//!
//! One byte, sent as a datagram: a lost probe is not repeated, the next one replaces it.
//!
//! ```text
//!   7   6   5   4   3   2   1   0
//! | o | q |   hears   |   dock    |
//! ```
//! `dock` is the index of the dock the probe leaves by, `hears` that of the neighbour's dock whose
//! probes arrive there, 7 for none; `q` asks for quick probes; `o` is set in every second probe.

use tasks::dock::Dock;

const HEARS_NOTHING: u8 = 7;
const QUICK: u8 = 1 << 6;
const ODD: u8 = 1 << 7;

/// A probe as its receiver sees it.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Probe {
    /// The sender's dock. The module types depend on it: a head's Back meets a Front, a left leg's
    /// Back meets a Left.
    pub dock: Dock,
    /// The receiver's dock that the sender hears at `dock`, if any.
    pub hears: Option<Dock>,
    /// Whether the sender misses probes of the receiver, and asks for more of them.
    pub wants_more: bool,
    /// Alternates from each probe that leaves by this dock to the next.
    pub is_odd: bool,
}

impl Probe {
    /// The probe as one payload byte.
    pub fn to_byte(self) -> u8 {
        let quick = if self.wants_more { QUICK } else { 0 };
        let odd = if self.is_odd { ODD } else { 0 };
        odd | quick | self.hears.map_or(HEARS_NOTHING, Dock::index) << 3 | self.dock.index()
    }

    /// The probe in `payload`, or `None` if it is not exactly one byte of the layout above.
    pub fn from_payload(payload: &[u8]) -> Option<Probe> {
        let &[byte] = payload else { return None };
        let dock = Dock::from_index(byte & 7)?;
        let hears = match byte >> 3 & 7 {
            HEARS_NOTHING => None,
            index => Some(Dock::from_index(index)?),
        };
        Some(Probe { dock, hears, wants_more: byte & QUICK != 0, is_odd: byte & ODD != 0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_probe_survives_its_byte_and_no_other_byte_is_a_probe() {
        let readable = (0..=u8::MAX)
            .filter_map(|byte| Some((byte, Probe::from_payload(&[byte])?)))
            .inspect(|&(byte, probe)| assert_eq!(probe.to_byte(), byte))
            .count();
        assert_eq!(readable, 6 * 7 * 2 * 2);
    }

    #[test]
    fn the_layout_is_the_documented_one() {
        let probe = Probe { dock: Dock::Left, hears: Some(Dock::Back), wants_more: false, is_odd: false };
        assert_eq!(probe.to_byte(), 0b00_001_010);
        assert_eq!(Probe { wants_more: true, ..probe }.to_byte(), 0b01_001_010);
        assert_eq!(Probe { dock: Dock::Front, hears: None, is_odd: true, ..probe }.to_byte(), 0b10_111_000);
    }

    #[test]
    fn a_probe_is_one_byte_long() {
        assert_eq!(Probe::from_payload(&[]), None);
        assert_eq!(Probe::from_payload(&[0, 0]), None);
    }
}
