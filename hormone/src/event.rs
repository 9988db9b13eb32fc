//! The events that the behaviours tell an on-chip debugger, one byte each, so that a bench or the simulator
//! can put a time to them.
//!
//! | byte | event |
//! |---|---|
//! | `0x10 + type` | the topology changed, and with it perhaps the type |
//! | `0x20 + data` | a hormone was generated here |
//! | `0x30 + action` | an action began, or goes on into another beat |
//! | `0x40 + 2·dock + data` | a hormone with data A or B was taken up at a dock |
//! | `0x50 + 2·dock + data` | a hormone with data A or B was handed to a dock's link |
//! | `0x60 + data` | a beat was acted on without its hormone, which did not come |
//! | `0x70 + dock` | a hormone came to a dock and was dropped |
//! | `0x80 + 8·dock + data` | a hormone with data C to F was taken up at a dock |
//! | `0xC0 + 8·dock + data` | a hormone with data C to F was handed to a dock's link |

use tasks::dock::Dock;

use crate::action::Action;
use crate::data::Data;
use crate::module_type::ModuleType;

const TOPOLOGY_CHANGED: u8 = 0x10;
const HORMONE_GENERATED: u8 = 0x20;
const HORMONE_RECEIVED: u8 = 0x40;
const HORMONE_SENT: u8 = 0x50;
const ACTION_BEGUN: u8 = 0x30;
const MADE_GOOD: u8 = 0x60;
const HORMONE_DROPPED: u8 = 0x70;
const LATER_RECEIVED: u8 = 0x80;
const LATER_SENT: u8 = 0xC0;

/// Something that happened in a behaviour.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Event {
    /// AC_RECV reported a change; this is the type of the module now.
    TopologyChanged(ModuleType),
    /// The module, a leader, generated a hormone with this data.
    HormoneGenerated(Data),
    /// A hormone with this data arrived at this dock, and was taken up.
    HormoneReceived(Dock, Data),
    /// A hormone with this data was handed to the link of this dock.
    HormoneSent(Dock, Data),
    /// The module performs this action from now on, for this beat and perhaps others.
    ActionBegun(Action),
    /// The hormone of this beat did not come, and the module acted as if it had.
    MadeGood(Data),
    /// A hormone of a gait arrived at this dock and was no news: of a beat that had been, or of a leader that
    /// this module does not follow.
    HormoneDropped(Dock),
}

impl Event {
    /// The event's code.
    pub const fn to_byte(self) -> u8 {
        match self {
            Event::TopologyChanged(module_type) => TOPOLOGY_CHANGED | module_type as u8,
            Event::HormoneGenerated(data) => HORMONE_GENERATED | data as u8,
            Event::HormoneReceived(dock, data) => at_dock(HORMONE_RECEIVED, LATER_RECEIVED, dock, data),
            Event::HormoneSent(dock, data) => at_dock(HORMONE_SENT, LATER_SENT, dock, data),
            Event::ActionBegun(action) => ACTION_BEGUN | action as u8,
            Event::MadeGood(data) => MADE_GOOD | data as u8,
            Event::HormoneDropped(dock) => HORMONE_DROPPED | dock.index(),
        }
    }

    /// The event with this code, or `None` if there is none.
    pub fn from_byte(byte: u8) -> Option<Event> {
        let low = byte & 0x0F;
        match byte & 0xF0 {
            TOPOLOGY_CHANGED => Some(Event::TopologyChanged(ModuleType::from_byte(low)?)),
            HORMONE_GENERATED => Some(Event::HormoneGenerated(Data::from_byte(low)?)),
            ACTION_BEGUN => Some(Event::ActionBegun(Action::from_byte(low)?)),
            MADE_GOOD => Some(Event::MadeGood(Data::from_byte(low)?)),
            HORMONE_DROPPED => Some(Event::HormoneDropped(Dock::from_index(low)?)),
            HORMONE_RECEIVED => {
                Some(Event::HormoneReceived(Dock::from_index(low >> 1)?, Data::from_byte(low & 1)?))
            }
            HORMONE_SENT => Some(Event::HormoneSent(Dock::from_index(low >> 1)?, Data::from_byte(low & 1)?)),
            _ => {
                let dock = Dock::from_index(byte >> 3 & 7)?;
                let data = Data::from_byte(byte & 7).filter(|&data| data as u8 > Data::B as u8)?;
                match byte & 0xC0 {
                    LATER_RECEIVED => Some(Event::HormoneReceived(dock, data)),
                    LATER_SENT => Some(Event::HormoneSent(dock, data)),
                    _ => None,
                }
            }
        }
    }
}

/// The code of what happened at a dock. `first` holds A and B, `later` the letters after them.
const fn at_dock(first: u8, later: u8, dock: Dock, data: Data) -> u8 {
    match data {
        Data::A | Data::B => first | dock.index() << 1 | data as u8,
        _ => later | dock.index() << 3 | data as u8,
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
        let actions = (0..=u8::MAX).filter_map(Action::from_byte).count();
        assert_eq!(readable, 8 + 6 + actions + 6 + 2 * 6 * 6 + 6);
    }

    #[test]
    fn the_codes_are_the_documented_ones() {
        assert_eq!(Event::TopologyChanged(ModuleType::Spine).to_byte(), 0x14);
        assert_eq!(Event::HormoneGenerated(Data::B).to_byte(), 0x21);
        assert_eq!(Event::HormoneReceived(Dock::Down, Data::B).to_byte(), 0x4B);
        assert_eq!(Event::HormoneSent(Dock::Back, Data::A).to_byte(), 0x52);
        assert_eq!(Event::HormoneReceived(Dock::Front, Data::E).to_byte(), 0x84);
        assert_eq!(Event::HormoneSent(Dock::Down, Data::C).to_byte(), 0xEA);
        assert_eq!(Event::ActionBegun(Action::Holding).to_byte(), 0x32);
        assert_eq!(Event::MadeGood(Data::F).to_byte(), 0x65);
        assert_eq!(Event::HormoneDropped(Dock::Down).to_byte(), 0x75);
    }
}
