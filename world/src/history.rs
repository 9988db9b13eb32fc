//! Records the last motions of the joints, to explain why a world broke.

use plants::trouble::Moment;

use crate::model::STEP_SECONDS;

/// The milliseconds that are kept.
const KEPT: usize = 100;

/// The last milliseconds that are reported one by one. Of the others, one in this many is reported.
const CLOSELY: usize = 10;

/// A joint: its angle in rad, its speed in rad/s, and the voltage at its motor in V.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    pub angle: f64,
    pub speed: f64,
    pub volts: f64,
}

/// The last milliseconds of all joints.
pub struct History {
    /// By module, in the order of hinges; the oldest is overwritten.
    kept: Vec<Vec<[Joint; 3]>>,
    /// Milliseconds since the beginning.
    now: usize,
}

impl History {
    pub fn new() -> Self {
        History { kept: vec![Vec::new(); KEPT + 1], now: 0 }
    }

    /// Keeps the joints of all modules as they are after another millisecond.
    pub fn keep(&mut self, joints: impl Iterator<Item = [Joint; 3]>) {
        self.now += 1;
        let place = &mut self.kept[self.now % (KEPT + 1)];
        place.clear();
        place.extend(joints);
    }

    /// The last moments of a joint, up to now.
    pub fn of(&self, module: usize, hinge: usize) -> Vec<Moment> {
        let first = self.now.saturating_sub(KEPT).max(1);
        let is_told = |step: &usize| {
            let before = self.now - step;
            before < CLOSELY || before.is_multiple_of(CLOSELY)
        };
        let moment = |step: usize| {
            let Joint { angle, speed, volts } = self.kept[step % (KEPT + 1)][module][hinge];
            Moment {
                seconds: step as f64 * STEP_SECONDS,
                degrees: angle.to_degrees(),
                degrees_per_second: speed.to_degrees(),
                volts,
            }
        };
        (first..=self.now).filter(is_told).map(moment).collect()
    }

    /// The module and hinge of the joint that turns fastest now, or a millisecond ago if a speed is not
    /// finite now. `None` if one is not finite in either.
    pub fn wildest(&self) -> Option<(usize, usize)> {
        let moments = [self.now, self.now.saturating_sub(1)].map(|step| &self.kept[step % (KEPT + 1)]);
        let all_numbers = |joints: &&Vec<[Joint; 3]>| joints.iter().flatten().all(|it| it.speed.is_finite());
        let joints = moments.into_iter().find(all_numbers)?;
        let speed = |&(module, hinge): &(usize, usize)| joints[module][hinge].speed.abs();
        let all = (0..joints.len()).flat_map(|module| [0, 1, 2].map(|hinge| (module, hinge)));
        all.max_by(|one, other| speed(one).total_cmp(&speed(other)))
    }

    /// The hinge of a module that turned fastest a millisecond ago, before its speed became no number.
    pub fn fastest(&self, module: usize) -> usize {
        let before = self.now.saturating_sub(1).max(1);
        let Some(joints) = self.kept[before % (KEPT + 1)].get(module) else { return 0 };
        let speed = |hinge: &usize| joints[*hinge].speed.abs();
        (0..3).max_by(|one, other| speed(one).total_cmp(&speed(other))).unwrap_or(0)
    }
}
