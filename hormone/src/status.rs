//! The view of a module from outside: from a debugger, the console or the simulator.

use core::mem::offset_of;

use crate::action::Action;
use crate::hormone::Data;
use crate::module_type::ModuleType;
use crate::neighbours::{NO_NEIGHBOUR, Neighbours, from_bytes};

/// Stands for "no hormone yet" in [`Status::hormone`].
pub const NO_HORMONE: u8 = 0xFF;

/// HORMONE's view of its module. The counters wrap.
///
/// | offset | bytes | field |
/// |---|---|---|
/// | 0 | 2 | `hormones_received` |
/// | 2 | 2 | `hormones_sent` |
/// | 4 | 2 | `topology_changes` |
/// | 6 | 2 | `malformed` |
/// | 8 | 2 | `hormones_unsent` |
/// | 10 | 2 | `made_good` |
/// | 12 | 2 | `dropped` |
/// | 14 | 6 | `neighbours` |
/// | 20 | 1 | `module_type` |
/// | 21 | 1 | `hormone` |
/// | 22 | 1 | `action` |
/// | 23 | 1 | `gait` |
///
/// Two-byte fields stand first, little-endian, so that the offsets do not depend on the alignment of
/// the machine that reads them.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(C)]
pub struct Status {
    /// Hormones received from neighbours.
    pub hormones_received: u16,
    /// Hormone messages handed to links: one for each dock that a hormone left by.
    pub hormones_sent: u16,
    /// How often the neighbours changed.
    pub topology_changes: u16,
    /// Messages to a behaviour that could not be read, and were ignored.
    pub malformed: u16,
    /// Hormone messages that found no room in a link's queue, and are lost.
    pub hormones_unsent: u16,
    /// Beats that were acted on without a hormone, because none came.
    pub made_good: u16,
    /// Hormones that were dropped: beats that had been, of another leader than the present one, or of an
    /// unknown gait; courses that were no news; orders for an unknown gait; tokens that came to no ring.
    pub dropped: u16,
    /// Per dock the index of the neighbour's dock, or 0xFF for none.
    pub neighbours: [u8; 6],
    /// The module's type.
    pub module_type: ModuleType,
    /// The [`Data`] of the last hormone received or generated, or [`NO_HORMONE`].
    pub hormone: u8,
    /// The action being performed.
    pub action: Action,
    /// The [name](crate::gait::Gait::name) of the gait.
    pub gait: u8,
}

const _: () = {
    assert!(offset_of!(Status, hormones_received) == 0);
    assert!(offset_of!(Status, hormones_sent) == 2);
    assert!(offset_of!(Status, topology_changes) == 4);
    assert!(offset_of!(Status, malformed) == 6);
    assert!(offset_of!(Status, hormones_unsent) == 8);
    assert!(offset_of!(Status, made_good) == 10);
    assert!(offset_of!(Status, dropped) == 12);
    assert!(offset_of!(Status, neighbours) == 14);
    assert!(offset_of!(Status, module_type) == 20);
    assert!(offset_of!(Status, hormone) == 21);
    assert!(offset_of!(Status, action) == 22);
    assert!(offset_of!(Status, gait) == 23);
};

impl Status {
    /// Bytes to read out of the module's RAM.
    pub const SIZE: usize = 24;

    /// A module at power-up.
    pub const POWER_UP: Status = Status {
        hormones_received: 0,
        hormones_sent: 0,
        topology_changes: 0,
        malformed: 0,
        hormones_unsent: 0,
        made_good: 0,
        dropped: 0,
        neighbours: [NO_NEIGHBOUR; 6],
        module_type: ModuleType::Other,
        hormone: NO_HORMONE,
        action: Action::Rest,
        gait: 0,
    };

    /// The status in `bytes` as read from a module, or `None` if they hold a value that no status has.
    pub fn from_bytes(bytes: &[u8; Status::SIZE]) -> Option<Status> {
        let &[
            r0,
            r1,
            s0,
            s1,
            t0,
            t1,
            m0,
            m1,
            u0,
            u1,
            g0,
            g1,
            d0,
            d1,
            ref neighbours @ ..,
            module_type,
            hormone,
            action,
            gait,
        ] = bytes;
        from_bytes(neighbours)?;
        if hormone != NO_HORMONE {
            Data::from_byte(hormone)?;
        }
        Some(Status {
            hormones_received: u16::from_le_bytes([r0, r1]),
            hormones_sent: u16::from_le_bytes([s0, s1]),
            topology_changes: u16::from_le_bytes([t0, t1]),
            malformed: u16::from_le_bytes([m0, m1]),
            hormones_unsent: u16::from_le_bytes([u0, u1]),
            made_good: u16::from_le_bytes([g0, g1]),
            dropped: u16::from_le_bytes([d0, d1]),
            neighbours: *neighbours,
            module_type: ModuleType::from_byte(module_type)?,
            hormone,
            action: Action::from_byte(action)?,
            gait,
        })
    }

    /// The neighbours, by dock.
    pub fn neighbours(&self) -> Option<Neighbours> {
        from_bytes(&self.neighbours)
    }

    /// The data of the last hormone received or generated.
    pub fn hormone(&self) -> Option<Data> {
        Data::from_byte(self.hormone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEEN: Status = Status {
        hormones_received: 0x0201,
        hormones_sent: 0x0403,
        topology_changes: 0x0605,
        malformed: 0x0807,
        hormones_unsent: 0x0A09,
        made_good: 0x0C0B,
        dropped: 0x0E0D,
        neighbours: [1, 0xFF, 5, 0, 0xFF, 2],
        module_type: ModuleType::Branch,
        hormone: Data::B as u8,
        action: Action::Holding,
        gait: 3,
    };
    const BYTES: [u8; Status::SIZE] =
        [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 1, 0xFF, 5, 0, 0xFF, 2, 5, 1, 2, 3];

    #[test]
    fn bytes_read_from_a_module_are_its_status() {
        assert_eq!(Status::from_bytes(&BYTES), Some(SEEN));
        assert_eq!(SEEN.hormone(), Some(Data::B));
        assert_eq!(Status::POWER_UP.hormone(), None);
    }

    #[test]
    fn bytes_that_are_no_status_are_refused() {
        for (offset, value) in [(14, 6), (19, 0x80), (20, 8), (21, 6), (22, 99)] {
            let mut bytes = BYTES;
            bytes[offset] = value;
            assert_eq!(Status::from_bytes(&bytes), None, "{value} at {offset}");
        }
    }
}
