//! What the behaviours tell an on-chip debugger, one byte at a time, so that a bench or the simulator
//! can put a time to it.
//!
//! | byte | event |
//! |---|---|
//! | `0x10 + type` | the topology changed, and with it perhaps the type |
//! | `0x20 + data` | a hormone was generated here |
//! | `0x40 + 2·dock + data` | a hormone was received at a dock |
//! | `0x50 + 2·dock + data` | a hormone was handed to a dock's link |

use tasks::dock::Dock;

use crate::hormone::Data;
use crate::module_type::ModuleType;

const TOPOLOGY_CHANGED: u8 = 0x10;
const HORMONE_GENERATED: u8 = 0x20;
const HORMONE_RECEIVED: u8 = 0x40;
const HORMONE_SENT: u8 = 0x50;

/// Something that happened in a behaviour.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Event {
    /// AC_RECV reported a change; this is the type of the module now.
    TopologyChanged(ModuleType),
    /// The module, a head, generated a hormone with this data.
    HormoneGenerated(Data),
    /// A hormone with this data arrived at this dock.
    HormoneReceived(Dock, Data),
    /// A hormone with this data was handed to the link of this dock.
    HormoneSent(Dock, Data),
}

impl Event {
    /// The event's code.
    pub const fn to_byte(self) -> u8 {
        match self {
            Event::TopologyChanged(module_type) => TOPOLOGY_CHANGED | module_type as u8,
            Event::HormoneGenerated(data) => HORMONE_GENERATED | data as u8,
            Event::HormoneReceived(dock, data) => HORMONE_RECEIVED | dock.index() << 1 | data as u8,
            Event::HormoneSent(dock, data) => HORMONE_SENT | dock.index() << 1 | data as u8,
        }
    }

    /// The event with this code, or `None` if it has none.
    pub fn from_byte(byte: u8) -> Option<Event> {
        let low = byte & 0x0F;
        match byte & 0xF0 {
            TOPOLOGY_CHANGED => Some(Event::TopologyChanged(ModuleType::from_byte(low)?)),
            HORMONE_GENERATED => Some(Event::HormoneGenerated(Data::from_byte(low)?)),
            HORMONE_RECEIVED => {
                Some(Event::HormoneReceived(Dock::from_index(low >> 1)?, Data::from_byte(low & 1)?))
            }
            HORMONE_SENT => Some(Event::HormoneSent(Dock::from_index(low >> 1)?, Data::from_byte(low & 1)?)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_event_survives_its_byte_and_no_other_byte_is_an_event() {
        let readable = (0..=u8::MAX)
            .filter_map(|byte| Some((byte, Event::from_byte(byte)?)))
            .inspect(|&(byte, event)| assert_eq!(event.to_byte(), byte))
            .count();
        assert_eq!(readable, 7 + 2 + 12 + 12);
    }

    #[test]
    fn the_codes_are_the_documented_ones() {
        assert_eq!(Event::TopologyChanged(ModuleType::Spine).to_byte(), 0x14);
        assert_eq!(Event::HormoneGenerated(Data::B).to_byte(), 0x21);
        assert_eq!(Event::HormoneReceived(Dock::Down, Data::B).to_byte(), 0x4B);
        assert_eq!(Event::HormoneSent(Dock::Back, Data::A).to_byte(), 0x52);
    }
}
