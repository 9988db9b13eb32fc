//! Measures whether the joints' control keeps time. A load pulls at the joints, so that they are never at
//! rest, and a probe watches the pin that is high while the control computes.

use tasks::motor::Axis;

use super::{MEASURED, MILLISECOND};
use crate::Controller;
use crate::bench::{BenchError, unmeasurable};
use crate::engine::Engine;
use crate::module::CONTROL_PROBE;
use crate::probe::Edge;

/// Cycles of a period of the joints' control.
const PERIOD: u64 = MILLISECOND;

/// The load on the joints, in Nm, in alternating directions: more than friction.
pub const PULL: f64 = 3.0;

/// The time after which the load changes its direction, in cycles.
pub const TURN: u64 = 80 * MILLISECOND;

/// Watches the control of the module's joints, in turns of [`TURN`].
pub struct Control {
    /// The cycles at which periods began, on each MCU.
    begins: [Vec<u64>; 2],
    /// The cycles at which the computation of a period was done, on each MCU.
    ends: [Vec<u64>; 2],
    /// The cycles at which watching began and ended.
    watched: [u64; 2],
    turns: u64,
}

impl Control {
    /// Pulls at the joints, and begins to watch a turn later.
    pub fn watch(engine: &mut Engine) -> Self {
        pull(engine, PULL);
        engine.run_until(engine.cycle() + TURN);
        if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
            for mcu in Controller::ALL {
                module.mcu_mut(mcu).add_probe(CONTROL_PROBE);
            }
        }
        let watched = [engine.cycle(); 2];
        Control { begins: [Vec::new(), Vec::new()], ends: [Vec::new(), Vec::new()], watched, turns: 0 }
    }

    /// Runs for a turn.
    pub fn turn(&mut self, engine: &mut Engine) {
        self.turn_by(engine, Engine::run_until);
    }

    /// Runs for a turn by `run`, which gets the cycle at which the turn ends.
    pub fn turn_by(&mut self, engine: &mut Engine, run: impl FnOnce(&mut Engine, u64)) {
        pull(engine, if self.turns.is_multiple_of(2) { -PULL } else { PULL });
        self.turns += 1;
        let end = engine.cycle() + TURN;
        run(engine, end);
        self.watched[1] = engine.cycle();
        if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
            for ((mcu, begins), ends) in Controller::ALL.into_iter().zip(&mut self.begins).zip(&mut self.ends)
            {
                for Edge { cycle, level } in module.mcu_mut(mcu).take_edges(0) {
                    if level { begins.push(cycle) } else { ends.push(cycle) }
                }
            }
        }
    }

    /// How well the master kept time; `None` if it began no period.
    pub fn of_master(&self) -> Option<Rhythm> {
        Rhythm::of(&self.begins[0], self.watched)
    }

    /// The longest time that the master took from the begin of a period until it was done, in cycles.
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

    /// The cycle at which the master began its last period; 0 if it began none.
    pub fn last(&self) -> u64 {
        self.begins[0].last().copied().unwrap_or(0)
    }

    /// The number of periods that should have begun.
    pub fn periods(&self) -> u64 {
        self.turns * TURN / PERIOD
    }

    /// The worse values of both MCUs.
    pub fn rhythm(&self) -> Result<Rhythm, BenchError> {
        let mut worst = Rhythm { jitter: 0, missed: 0 };
        for begins in &self.begins {
            let rhythm = Rhythm::of(begins, self.watched)
                .ok_or_else(|| unmeasurable("firmware-master", "its joints are not controlled"))?;
            worst.jitter = worst.jitter.max(rhythm.jitter);
            worst.missed = worst.missed.max(rhythm.missed);
        }
        Ok(worst)
    }
}

/// Pulls at all joints of the module, in Nm.
pub fn pull(engine: &mut Engine, torque: f64) {
    if let Some(module) = engine.robot_mut().module_mut(MEASURED) {
        for axis in Axis::ALL {
            module.body_mut().joint_mut(axis).surroundings.load_torque = torque;
        }
    }
}

/// From the earliest to the latest begin within a period, in cycles, among consecutive periods. After a rest
/// the count starts again.
pub fn jitter(begins: &[u64]) -> u64 {
    let runs = begins.chunk_by(|one, next| (next - one).abs_diff(PERIOD) < PERIOD / 2);
    let rhythm = |run: &[u64]| Rhythm::of(run, [*run.first()?, *run.last()?]);
    runs.filter_map(rhythm).map(|rhythm| rhythm.jitter).max().unwrap_or(0)
}

/// The offset of each begin from the nearest multiple of a period, counted from the first one, in cycles.
pub(super) fn offsets(begins: &[u64]) -> impl Iterator<Item = i64> {
    let since_first = begins.iter().filter_map(|begin| Some(begin - begins.first()?));
    since_first.map(|begin| begin as i64 - ((begin + PERIOD / 2) / PERIOD * PERIOD) as i64)
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
    /// The rhythm of the periods that began between the cycles `start` and `end`; `None` if none began.
    fn of(begins: &[u64], [start, end]: [u64; 2]) -> Option<Rhythm> {
        let jitter = offsets(begins).max()?.abs_diff(offsets(begins).min()?);
        // Missed periods show in the gaps between begins, and between these and both ends of the watch. The
        // number of begins alone would not do: one that is due just as the watch ends may or may not be among
        // them.
        let from = [start].into_iter().chain(begins.iter().copied());
        let to = begins.iter().copied().chain([end]);
        let missed = |(from, to): (u64, u64)| ((to - from + PERIOD / 2) / PERIOD).saturating_sub(1);
        Some(Rhythm { jitter, missed: from.zip(to).map(missed).sum() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_is_from_the_earliest_to_the_latest() {
        let rhythm =
            |begins: &[u64]| Rhythm::of(begins, [0, 48_000]).map(|rhythm| (rhythm.jitter, rhythm.missed));
        assert_eq!(rhythm(&[]), None);
        assert_eq!(rhythm(&[100, 16_100, 32_100]), Some((0, 0)));
        assert_eq!(rhythm(&[100, 16_400, 32_050]), Some((350, 0)));
        assert_eq!(rhythm(&[100, 32_110]), Some((10, 1)));
        // A period that is due as the watch ends or begins is not missed.
        assert_eq!(rhythm(&[15_990, 32_000]), Some((10, 0)));
        assert_eq!(rhythm(&[16_010, 32_000, 47_990]), Some((20, 0)));
        assert_eq!(rhythm(&[24_100, 40_100]), Some((0, 1)), "none began at first");
        assert_eq!(rhythm(&[100]), Some((0, 2)), "none began any more");
    }

    #[test]
    fn after_a_rest_periods_count_from_anew() {
        assert_eq!(jitter(&[]), 0);
        assert_eq!(jitter(&[100, 16_130, 32_100]), 30);
        assert_eq!(jitter(&[100, 16_130, 77_777, 79_142, 95_152, 111_142]), 30);
    }
}
