//! What a robot has been through while it ran.

use crate::change::Change;

/// What a robot has been through, which decides whether it is asked how far it has come.
#[derive(Clone, Copy)]
pub struct Course {
    /// It was told to walk by another gait.
    pub is_ordered: bool,
    /// Nothing has happened to it that would stop a robot.
    pub is_undisturbed: bool,
}

impl Course {
    /// Nothing has happened to it yet.
    pub const NEW: Course = Course { is_ordered: false, is_undisturbed: true };

    /// This has happened to it.
    pub fn take(&mut self, change: &Change) {
        let ordered = change.orders().map(|(_, gait, _)| gait);
        self.is_ordered |= ordered.is_some();
        self.is_undisturbed &= match (change, ordered) {
            (_, Some(gait)) => gait.is_some_and(|name| name.gait().once.is_none()),
            (Change::Obstacle { .. } | Change::Console(_), _) => true,
            (Change::Loss { probability, .. } | Change::Noise { probability, .. }, _) => *probability == 0.0,
            _ => false,
        };
    }
}
