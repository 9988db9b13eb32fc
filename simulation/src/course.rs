//! The events that a robot has been through while it ran.

use hormone::gait::GaitName;

use crate::change::Change;
use crate::scenario::Event;

/// The events that a robot has been through. They decide whether it is judged by how far it has come.
#[derive(Clone, Copy)]
pub struct Course {
    /// When it was first told to walk by another gait, in cycles since power-up.
    pub ordered_at: Option<u64>,
    /// Nothing has happened to it that would stop a robot.
    pub is_undisturbed: bool,
}

impl Course {
    /// Nothing has happened to it yet.
    pub const NEW: Course = Course { ordered_at: None, is_undisturbed: true };

    /// Takes in an event that has happened to it.
    pub fn take(&mut self, &Event { at, ref change }: &Event) {
        let ordered = change.orders().map(|(_, gait, _)| gait);
        if ordered.is_some() {
            self.ordered_at.get_or_insert(at);
        }
        self.is_undisturbed &= match (change, ordered) {
            (_, Some(gait)) => GaitName::from_byte(gait).is_some_and(|name| name.gait().once.is_none()),
            (Change::Obstacle { .. } | Change::SharedLight(_) | Change::Console(_), _) => true,
            (Change::Loss { probability, .. } | Change::Noise { probability, .. }, _) => *probability == 0.0,
            _ => false,
        };
    }
}

#[cfg(test)]
mod tests {
    use tasks::dock::Dock;

    use super::*;
    use crate::change::{Links, Mcus};
    use crate::wiring::Face;

    #[test]
    fn a_robot_is_judged_by_its_way_unless_something_may_have_stopped_it() {
        let at = Face { module: 1, dock: Dock::Up };
        let order = |gait: u8| Change::Command { at, payload: vec![0xd0 + gait, 1, 255] };
        let loss = |probability| Change::Loss { links: Links::All, probability };
        let noise = |probability| Change::Noise { links: Links::From(at), probability };
        for (change, is_judged, is_told) in [
            (order(GaitName::Caterpillar as u8), true, true),
            (order(0), false, true),
            (order(GaitName::CloseRing as u8), false, true),
            (order(11), false, true),
            (Change::Obstacle { at, is_there: true }, true, false),
            (Change::SharedLight(true), true, false),
            (Change::Console(at), true, false),
            (loss(0.0), true, false),
            (loss(0.1), false, false),
            (noise(0.0), true, false),
            (noise(0.1), false, false),
            (Change::Reset { module: 1, mcus: Mcus::Both }, false, false),
            (Change::Roll(10.0), false, false),
        ] {
            let mut course = Course::NEW;
            course.take(&Event { at: 7, change: change.clone() });
            // What comes later neither makes good what has stopped it, nor is it told to walk anew.
            course.take(&Event { at: 9, change: order(GaitName::Caterpillar as u8) });
            let told_at = if is_told { 7 } else { 9 };
            assert_eq!((course.is_undisturbed, course.ordered_at), (is_judged, Some(told_at)), "{change}");
        }
    }
}
