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

#[cfg(test)]
mod tests {
    use super::*;

    /// The joints of two modules after a step: their angles tell the step, the module and the hinge.
    fn joints(step: usize, speeds: [[f64; 3]; 2]) -> impl Iterator<Item = [Joint; 3]> {
        (0..2).map(move |module| {
            [0, 1, 2].map(|hinge| Joint {
                angle: (10 * step + 3 * module + hinge) as f64,
                speed: speeds[module][hinge],
                volts: -(step as f64),
            })
        })
    }

    #[test]
    fn of_the_last_100_ms_the_last_ten_are_told_and_every_tenth_before() {
        for now in [1, 9, 10, 11, 99, 100, 101, 102, 1000] {
            let mut history = History::new();
            (1..=now).for_each(|step| history.keep(joints(step, [[step as f64; 3]; 2])));
            let ages = (0..10).chain((10..=90).step_by(10)).chain([100]).filter(|age| *age < now);
            let steps: Vec<usize> = ages.map(|age| now - age).collect();
            for (module, hinge) in [(0, 0), (1, 2)] {
                let expected = steps.iter().rev().map(|&step| Moment {
                    seconds: step as f64 * STEP_SECONDS,
                    degrees: ((10 * step + 3 * module + hinge) as f64).to_degrees(),
                    degrees_per_second: (step as f64).to_degrees(),
                    volts: -(step as f64),
                });
                let told = history.of(module, hinge);
                assert_eq!(told, expected.collect::<Vec<_>>(), "{module} and {hinge} after {now} ms");
            }
        }
    }

    #[test]
    fn the_joint_that_turns_fastest_is_named_by_the_last_speeds_that_are_numbers() {
        const NAN: f64 = f64::NAN;
        let calm = [[0.0; 3]; 2];
        let back = [[1.0, -2.0, 3.0], [0.0, 4.0, -5.0]];
        let front = [[1.0, -6.0, 3.0], [5.0, 4.0, 2.0]];
        let part = [[1.0, 2.0, 3.0], [0.0, NAN, 9.0]];
        let none = [[NAN; 3], [NAN, NAN, NAN]];
        for (before, after, wildest, fastest) in [
            (calm, back, Some((1, 2)), [2, 2]),
            (back, front, Some((0, 1)), [2, 2]),
            (front, back, Some((1, 2)), [1, 0]),
            (front, part, Some((0, 1)), [1, 0]),
            (back, none, Some((1, 2)), [2, 2]),
            (part, none, None, [2, 1]),
        ] {
            // Also where the oldest moments have been overwritten.
            for now in [2, 100, 101, 102, 203] {
                let mut history = History::new();
                for step in 1..=now {
                    let speeds = if step == now { after } else { before };
                    history.keep(joints(step, speeds));
                }
                assert_eq!(history.wildest(), wildest, "{before:?}, {after:?} after {now} ms");
                assert_eq!(
                    [0, 1].map(|module| history.fastest(module)),
                    fastest,
                    "{before:?} after {now} ms"
                );
            }
        }
    }
}
