//! Where the joints are to be.

use core::num::NonZeroU16;

use super::Controller;
use crate::action::Posture;
use crate::module_type::ModuleType;
use crate::order::Course;

impl Controller {
    /// The target of the joints at `now`, or `None` if they are to stay where they are.
    ///
    /// A right leg mirrors a left one: it rolls to the other side. A leg on the side that the robot turns to
    /// takes half the stride, and backward: half the stride ahead does not turn a robot that is longer than
    /// it is wide. A module alone rolls to and fro to turn; a turn to the right mirrors one to the left.
    pub fn posture(&self, now: u16) -> Option<Posture> {
        let (index, _) = self.progress(now)?;
        let posture = self.status.action.motion().get(index)?;
        let motor2 = match (self.acting, self.helm.course()) {
            (ModuleType::LeftLeg, Course::Left) | (ModuleType::RightLeg, Course::Right) => {
                (posture.motor2 / 2).wrapping_neg()
            }
            _ => posture.motor2,
        };
        let roll = match (self.acting, self.helm.course()) {
            (ModuleType::RightLeg, _) | (ModuleType::Alone, Course::Right) => posture.roll.wrapping_neg(),
            (ModuleType::Alone, Course::Ahead) => 0,
            _ => posture.roll,
        };
        Some(Posture { motor2, roll, ..posture })
    }

    /// Milliseconds from `now` until the action's next posture; `None` while it has no other.
    pub fn until_posture(&self, now: u16) -> Option<u16> {
        let (_, left) = self.progress(now)?;
        left
    }

    /// The index of the action's posture at `now`, and the milliseconds for which it still lasts; `None` for
    /// the last.
    fn progress(&self, now: u16) -> Option<(usize, Option<u16>)> {
        let steps = self.status.action.motion().len();
        let last = steps.checked_sub(1)?;
        if last == 0 {
            return Some((0, None));
        }
        let (_, beat_at) = self.pacemaker.last();
        let beat = self.gait().beat.get();
        let step = beat.wrapping_mul(self.part.of.into()) / NonZeroU16::new(steps as u16)?;
        let mut elapsed = beat.wrapping_mul(self.part.before.into()).wrapping_add(now.wrapping_sub(beat_at));
        // A few subtractions take less than a division.
        for index in 0..last {
            if elapsed < step {
                return Some((index, Some(step - elapsed)));
            }
            elapsed -= step;
        }
        Some((last, None))
    }
}
