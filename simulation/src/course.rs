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
            (Change::Obstacle { .. } | Change::Console(_), _) => true,
            (Change::Loss { probability, .. } | Change::Noise { probability, .. }, _) => *probability == 0.0,
            _ => false,
        };
    }
}
