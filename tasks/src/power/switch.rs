//! A dock's power switch: it joins the module's supply to the neighbour's.
//!
//! The board opens a switch by itself, in the converter's interrupt, as soon as its current is out of bounds:
//! a task could be held up too long for that. This state machine knows why a switch is open.

/// A switch.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug, Hash))]
#[repr(u8)]
pub enum Switch {
    Open = 0,
    Closed = 1,
    /// Opened by the board for too much current. Only an order closes it again.
    Tripped = 2,
    /// Opened to save the battery. It closes when there is power again.
    Shed = 3,
}

impl Switch {
    /// The switch with this code; `None` above 3.
    pub const fn from_code(code: u8) -> Option<Switch> {
        match code {
            0 => Some(Switch::Open),
            1 => Some(Switch::Closed),
            2 => Some(Switch::Tripped),
            3 => Some(Switch::Shed),
            _ => None,
        }
    }

    /// Closes the switch if the battery allows it, else as soon as it does.
    pub fn close(&mut self, is_allowed: bool) {
        *self = if is_allowed { Switch::Closed } else { Switch::Shed };
    }

    /// Opens the switch.
    pub fn open(&mut self) {
        *self = Switch::Open;
    }

    /// The board has opened the switch. Returns whether that is news.
    pub fn trip(&mut self) -> bool {
        let was_closed = *self == Switch::Closed;
        if was_closed {
            *self = Switch::Tripped;
        }
        was_closed
    }

    /// The battery allows the switch to be closed, or no longer does. Returns whether the switch changed.
    pub fn allow(&mut self, is_allowed: bool) -> bool {
        let now = match (*self, is_allowed) {
            (Switch::Closed, false) => Switch::Shed,
            (Switch::Shed, true) => Switch::Closed,
            (other, _) => other,
        };
        core::mem::replace(self, now) != now
    }

    /// Whether the switch is to be closed.
    pub fn is_closed(self) -> bool {
        self == Switch::Closed
    }
}

#[cfg(test)]
mod tests {
    use super::Switch::{self, *};

    #[test]
    fn every_event_in_every_state() {
        let after = |mut switch: Switch, event: fn(&mut Switch)| {
            event(&mut switch);
            switch
        };
        for switch in [Open, Closed, Tripped, Shed] {
            assert_eq!(after(switch, |switch| switch.close(true)), Closed);
            assert_eq!(after(switch, |switch| switch.close(false)), Shed);
            assert_eq!(after(switch, Switch::open), Open);
            let tripped = if switch == Closed { Tripped } else { switch };
            assert_eq!(after(switch, |switch| _ = switch.trip()), tripped);
            let shed = if switch == Closed { Shed } else { switch };
            assert_eq!(after(switch, |switch| _ = switch.allow(false)), shed);
            let back = if switch == Shed { Closed } else { switch };
            assert_eq!(after(switch, |switch| _ = switch.allow(true)), back);
            assert_eq!(switch.is_closed(), switch == Closed);
        }
    }

    #[test]
    fn a_change_is_told_once() {
        let mut switch = Closed;
        assert!(switch.trip() && !switch.trip());
        switch.close(true);
        assert!(switch.allow(false) && !switch.allow(false));
        assert!(switch.allow(true) && !switch.allow(true));
    }
}
