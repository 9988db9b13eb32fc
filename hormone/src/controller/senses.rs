//! The sensors that rules depend on: when they are asked, and what they read.

use super::Controller;
use crate::case::{Case, Source};
use crate::sense::{Sense, between_readings};
use crate::time::until;

impl Controller {
    /// The senses whose sensors are to be asked at `now`: those that are a condition of a rule for this type,
    /// eight times a beat. The answers go to [`read`](Self::read).
    pub fn asks(&mut self, now: u16) -> impl Iterator<Item = Sense> {
        let is_beat = core::mem::take(&mut self.is_beat);
        if is_beat {
            self.senses.beat();
            self.minded = Sense::ALL.map(|sense| self.minds(sense));
        }
        let is_due = is_beat || self.next_ask(now) == Some(0);
        if is_due {
            self.ask_again_at = now.wrapping_add(between_readings(self.gait().beat));
        }
        let asks = self.minded.map(|is_minded| is_minded && is_due);
        Sense::ALL.into_iter().zip(asks).filter(|(_, asks)| *asks).map(|(sense, _)| sense)
    }

    /// Milliseconds from `now` until sensors are to be asked again; `None` while none is.
    pub fn next_ask(&self, now: u16) -> Option<u16> {
        self.minded.contains(&true).then(|| until(self.ask_again_at, now))
    }

    /// Whether a rule for this type has this sense as its condition.
    fn minds(&self, sense: Sense) -> bool {
        let case = Case::new(self.acting, Source::Timer).given(Some(sense));
        self.gait().rules.iter().any(|rule| rule.case.is_like(case))
    }

    /// Takes in `value`, a reading of the sensor of `sense`.
    pub fn read(&mut self, sense: Sense, value: i16) {
        self.senses.read(sense, value);
    }
}
