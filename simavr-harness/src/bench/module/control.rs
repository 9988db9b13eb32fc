//! Whether the joints' control keeps time: something pulls at the joints, so that they are never at rest, and
//! the pin that is high while the control computes is watched.

use tasks::motor::Axis;

use super::{MEASURED, MILLISECOND};
use crate::bench::{BenchError, unmeasurable};
use crate::controller::Controller;
use crate::engine::Engine;
use crate::module::CONTROL_PROBE;
use crate::probe::Edge;

/// Cycles of a period of the joints' control.
const PERIOD: u64 = MILLISECOND;

/// What pulls at the joints, in Nm, to and fro: more than friction.
const PULL: f64 = 3.0;

/// How often that is turned, in cycles.
pub const TURN: u64 = 80 * MILLISECOND;

/// Watches the control of the module's joints, in turns of [`TURN`].
pub struct Control {
    /// When its periods began, on each MCU.
    begins: [Vec<u64>; 2],
    /// When it was done with them.
    ends: [Vec<u64>; 2],
    turns: u64,
}

impl Control {
    /// Pulls at the joints, and watches from a turn later on.
    pub fn watch(engine: &mut Engine) -> Self {
        pull(engine, PULL);
        engine.run_until(engine.cycle() + TURN);
        if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
            for mcu in Controller::ALL {
                module.mcu_mut(mcu).add_probe(CONTROL_PROBE);
            }
        }
        Control { begins: [Vec::new(), Vec::new()], ends: [Vec::new(), Vec::new()], turns: 0 }
    }

    /// Runs for a turn.
    pub fn turn(&mut self, engine: &mut Engine) {
        self.turn_by(engine, Engine::run_until);
    }

    /// Has `run` run for a turn, up to the cycle that it is given.
    pub fn turn_by(&mut self, engine: &mut Engine, run: impl FnOnce(&mut Engine, u64)) {
        pull(engine, if self.turns.is_multiple_of(2) { -PULL } else { PULL });
        self.turns += 1;
        let end = engine.cycle() + TURN;
        run(engine, end);
        if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
            for ((mcu, begins), ends) in Controller::ALL.into_iter().zip(&mut self.begins).zip(&mut self.ends)
            {
                for Edge { cycle, level } in module.mcu_mut(mcu).take_edges(0) {
                    if level { begins.push(cycle) } else { ends.push(cycle) }
                }
            }
        }
    }

    /// How well the master kept time.
    pub fn of_master(&self) -> Option<Rhythm> {
        Rhythm::of(&self.begins[0], self.periods())
    }

    /// How long the master took at most from the begin of a period until it was done with it, in cycles.
    pub fn longest(&self) -> u64 {
        let [begins, _] = &self.begins;
        let [ends, _] = &self.ends;
        let mut ends = ends.iter().peekable();
        let spans = begins.iter().filter_map(|begin| {
            while ends.next_if(|end| *end < begin).is_some() {}
            ends.peek().map(|end| **end - begin)
        });
        spans.max().unwrap_or(0)
    }

    /// When the master began its last period; 0 if it did none.
    pub fn last(&self) -> u64 {
        self.begins[0].last().copied().unwrap_or(0)
    }

    /// Periods that should have begun.
    pub fn periods(&self) -> u64 {
        self.turns * TURN / PERIOD
    }

    /// How well both MCUs kept time.
    pub fn rhythm(&self) -> Result<Rhythm, BenchError> {
        let periods = self.periods();
        let mut worst = Rhythm { jitter: 0, missed: 0 };
        for begins in &self.begins {
            let rhythm = Rhythm::of(begins, periods)
                .ok_or_else(|| unmeasurable("firmware-master", "its joints are not controlled"))?;
            worst.jitter = worst.jitter.max(rhythm.jitter);
            worst.missed = worst.missed.max(rhythm.missed);
        }
        Ok(worst)
    }
}

/// Pulls at all joints of the module, in Nm.
fn pull(engine: &mut Engine, torque: f64) {
    if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
        for axis in Axis::ALL {
            module.body_mut().joint_mut(axis).surroundings.load_torque = torque;
        }
    }
}

/// How well the control keeps time.
#[derive(Debug, PartialEq, Eq)]
pub struct Rhythm {
    /// From the earliest to the latest begin within a period, in cycles.
    pub jitter: u64,
    /// Periods that did not begin.
    pub missed: u64,
}

impl Rhythm {
    /// Of so many periods that should have begun; `None` without any begin.
    fn of(begins: &[u64], periods: u64) -> Option<Rhythm> {
        let first = *begins.first()?;
        // From the nearest multiple of a period after the first.
        let offsets = || {
            begins.iter().map(|begin| {
                let nearest = (begin - first + PERIOD / 2) / PERIOD * PERIOD;
                (begin - first) as i64 - nearest as i64
            })
        };
        let jitter = offsets().max()?.abs_diff(offsets().min()?);
        Some(Rhythm { jitter, missed: periods.saturating_sub(begins.len() as u64) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_is_from_the_earliest_to_the_latest() {
        let rhythm = |begins: &[u64]| Rhythm::of(begins, 3).map(|rhythm| (rhythm.jitter, rhythm.missed));
        assert_eq!(rhythm(&[]), None);
        assert_eq!(rhythm(&[100, 16_100, 32_100]), Some((0, 0)));
        assert_eq!(rhythm(&[100, 16_400, 32_050]), Some((350, 0)));
        assert_eq!(rhythm(&[100, 48_110]), Some((10, 1)));
    }
}
