//! Observes the module while a case runs.

use hormone::event::Event as Behaviour;
use serde::Serialize;
use simulation::{Hops, TraceEvent};

use crate::Controller;
use crate::bench::module::{MEASURED, MILLISECOND};
use crate::counters;
use crate::engine::Engine;

/// How a behaviour with a period kept it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Periodic {
    /// Periods, and the periods in which the behaviour had no turn.
    pub periods: u64,
    pub missed: u64,
    /// The longest pause between two turns beyond a period, in ms.
    pub late_ms_max: f64,
}

impl Periodic {
    /// The result for turns at the cycles `turns`, the first of which was on time, until `end`.
    fn of(turns: &[u64], period: u64, end: u64) -> Periodic {
        let Some(&first) = turns.first() else {
            return Periodic { periods: 0, missed: 0, late_ms_max: 0.0 };
        };
        // A turn belongs to the period whose begin is nearest.
        let number = |cycle: u64| (cycle - first + period / 2) / period;
        let mut kept: Vec<u64> = turns.iter().map(|turn| number(*turn)).collect();
        kept.dedup();
        let periods = (end - first) / period;
        let next = turns.iter().copied().skip(1).chain([end]);
        let pause = turns.iter().zip(next).map(|(turn, next)| next - turn).max().unwrap_or(0);
        Periodic {
            periods,
            missed: (periods + 1).saturating_sub(kept.len() as u64),
            late_ms_max: pause.saturating_sub(period) as f64 / MILLISECOND as f64,
        }
    }
}

/// Follows hormones, marks and counts.
pub struct Watch {
    pub start: u64,
    pub hops: Hops,
    bytes_lost: u64,
    /// Whether a count of lost bytes has reached the most that it holds, and says no more.
    is_full: bool,
    pub frames_repeated: u64,
    /// Edges that were not answered before the next.
    pub unanswered: u64,
    edge: Option<u64>,
    reactions: Vec<u64>,
    marks: Vec<(u64, u8)>,
    overruns: [u16; 3],
    repeated: Vec<Count>,
}

/// What a counter of an MCU counts.
#[derive(Clone, Copy)]
struct Count {
    /// How often the MCU was reset, which sets its counters back to 0.
    resets: u64,
    value: u16,
}

impl Count {
    /// How much was counted since `before`, within less than 65,536. The counter wraps.
    fn since(self, before: Count) -> u64 {
        let start = if self.resets == before.resets { before.value } else { 0 };
        self.value.wrapping_sub(start).into()
    }
}

impl Watch {
    /// Begins to watch.
    pub fn begin(engine: &mut Engine) -> Self {
        engine.take_events();
        Watch {
            start: engine.cycle(),
            hops: Hops::new(engine.robot().modules()),
            bytes_lost: 0,
            is_full: false,
            frames_repeated: 0,
            unanswered: 0,
            edge: None,
            reactions: Vec::new(),
            marks: Vec::new(),
            overruns: overruns(engine),
            repeated: repeated(engine),
        }
    }

    /// Notes an edge at `cycle`.
    pub fn edge(&mut self, cycle: u64) {
        self.unanswered += u64::from(self.edge.replace(cycle).is_some());
    }

    /// Evaluates the markers and counters since the last call.
    pub fn look(&mut self, engine: &mut Engine) {
        for told in engine.take_events() {
            if told.controller != Controller::Master {
                continue;
            }
            if let Some(event) = Behaviour::from_byte(told.value) {
                let trace_event = TraceEvent { cycle: told.cycle, module: told.module, event };
                self.hops.take(&trace_event, engine.robot().wiring());
            } else if told.module == MEASURED {
                self.mark(told.cycle, told.value);
            }
        }
        // A reset sets the counters back to 0.
        let overruns = overruns(engine);
        for (now, before) in overruns.into_iter().zip(self.overruns) {
            self.bytes_lost += u64::from(now.checked_sub(before).unwrap_or(now));
        }
        self.is_full |= overruns.contains(&u16::MAX);
        self.overruns = overruns;
        let repeated = repeated(engine);
        let pairs = repeated.iter().zip(&self.repeated);
        self.frames_repeated += pairs.map(|(now, before)| now.since(*before)).sum::<u64>();
        self.repeated = repeated;
    }

    /// The bytes and frames that were lost on the way in; `None` if they were more than a link counts.
    pub fn bytes_lost(&self) -> Option<u64> {
        (!self.is_full).then_some(self.bytes_lost)
    }

    fn mark(&mut self, cycle: u64, value: u8) {
        self.marks.push((cycle, value));
        if value == trial::mark::EDGE
            && let Some(edge) = self.edge.take_if(|edge| *edge <= cycle)
        {
            self.reactions.push(cycle - edge);
        }
    }

    /// The time from an edge to its answer, in cycles: mean and longest.
    pub fn reaction(&self) -> Option<(f64, u64)> {
        let longest = self.reactions.iter().copied().max()?;
        Some((self.reactions.iter().sum::<u64>() as f64 / self.reactions.len() as f64, longest))
    }

    /// How the behaviour that writes `mark` every `period_ms` ms kept its period, until `end`.
    pub fn periodic(&self, mark: u8, period_ms: u16, end: u64) -> Periodic {
        let turns: Vec<u64> =
            self.marks.iter().filter(|(_, value)| *value == mark).map(|(cycle, _)| *cycle).collect();
        Periodic::of(&turns, u64::from(period_ms) * MILLISECOND, end)
    }
}

/// The bytes and frames that each link of the measured master has lost on the way in.
fn overruns(engine: &Engine) -> [u16; 3] {
    let mut overruns = [0; 3];
    if let Some(module) = engine.robot().module(MEASURED) {
        for (sum, link) in overruns.iter_mut().zip(counters::links(module.mcu(Controller::Master))) {
            *sum = link.overruns;
        }
    }
    overruns
}

/// Frames that the head and the tail have sent to the module more than once, or given up: the counts of each
/// of their links.
fn repeated(engine: &Engine) -> Vec<Count> {
    let neighbours = [1, 2].into_iter().filter_map(|number| engine.robot().module(number));
    let mcus = neighbours.flat_map(|module| Controller::ALL.map(|controller| module.mcu(controller)));
    let counts = mcus.flat_map(|mcu| {
        let count = |value| Count { resets: mcu.resets(), value };
        counters::links(mcu).flat_map(move |link| [link.retries, link.gave_up].map(count))
    });
    counts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_without_its_turn_is_missed_however_many_turns_follow() {
        let of = |turns: &[u64], end| {
            let turns: Vec<u64> = turns.iter().map(|ms| ms * MILLISECOND).collect();
            let Periodic { periods, missed, late_ms_max } =
                Periodic::of(&turns, 10 * MILLISECOND, end * MILLISECOND);
            (periods, missed, late_ms_max)
        };
        assert_eq!(of(&[], 100), (0, 0, 0.0));
        assert_eq!(of(&[5, 15, 25, 35], 35), (3, 0, 0.0));
        assert_eq!(of(&[5, 15, 27, 35], 35), (3, 0, 2.0));
        assert_eq!(of(&[5, 34, 34, 34, 45], 45), (4, 2, 19.0));
        assert_eq!(of(&[5, 15], 45), (4, 3, 20.0));
    }

    #[test]
    fn a_count_goes_on_where_its_counter_wraps_and_begins_again_at_a_reset() {
        let count = |resets, value| Count { resets, value };
        assert_eq!(count(0, 7).since(count(0, 5)), 2);
        assert_eq!(count(0, 4).since(count(0, 65_530)), 10);
        assert_eq!(count(1, 4).since(count(0, 65_530)), 4);
    }
}
