//! The hormone: a message without destination or ID, which acts through the rules of its receivers.
//!
//! On the wire two bytes, `[name, data]`. A lifetime is not among them yet: it comes with the robots
//! whose modules form a loop, where a hormone would circulate for ever. In a tree it ends at the
//! leaves.

/// Which hormone.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(u8)]
pub enum HormoneName {
    /// The centipede's pace (paper, section 7).
    CP = 1,
}

/// A hormone's data field.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(u8)]
pub enum Data {
    /// Sent by the head at the start of a Period.
    A = 0,
    /// Sent by the head at half a Period.
    B = 1,
}

impl Data {
    /// The value with code `byte`.
    pub const fn from_byte(byte: u8) -> Option<Data> {
        match byte {
            0 => Some(Data::A),
            1 => Some(Data::B),
            _ => None,
        }
    }
}

/// A hormone message.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Hormone {
    /// Which hormone.
    pub name: HormoneName,
    /// What it carries.
    pub data: Data,
}

impl Hormone {
    /// The hormone as a message payload.
    pub fn to_payload(self) -> [u8; 2] {
        [self.name as u8, self.data as u8]
    }

    /// The hormone in `payload`, or `None` if it has another length, an unknown name or unknown data.
    pub fn from_payload(payload: &[u8]) -> Option<Hormone> {
        let &[name, data] = payload else { return None };
        if name != HormoneName::CP as u8 {
            return None;
        }
        Some(Hormone { name: HormoneName::CP, data: Data::from_byte(data)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_payload_is_name_then_data() {
        assert_eq!(Hormone { name: HormoneName::CP, data: Data::B }.to_payload(), [1, 1]);
    }

    #[test]
    fn every_hormone_survives_its_payload_and_nothing_else_is_one() {
        for first in 0..=u8::MAX {
            for second in 0..=u8::MAX {
                let payload = [first, second];
                let hormone = Hormone::from_payload(&payload);
                assert_eq!(hormone.map(Hormone::to_payload), (first == 1 && second < 2).then_some(payload));
            }
        }
        assert_eq!(Hormone::from_payload(&[1]), None);
        assert_eq!(Hormone::from_payload(&[1, 0, 0]), None);
    }
}
