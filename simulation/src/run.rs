//! A robot on its way through a timeline.

use crate::change::Change;
use crate::hardware::STEP;
use crate::observer::Observer;
use crate::recording::{Recorder, Recording};
use crate::robot::Robot;
use crate::scenario::{Event, Impossible};
use crate::wiring::WiringError;

/// A robot that runs, what is still to happen to it, and its observer.
pub struct Run<R> {
    pub robot: R,
    pub observer: Observer,
    /// The events of the timeline that could not happen, in order.
    pub impossible: Vec<Impossible>,
    /// The events that have happened to it from outside, in order.
    happened: Vec<Event>,
    /// The latest first.
    timeline: Vec<Event>,
    /// Where the step under way ends.
    step_end: Option<u64>,
}

impl<R: Robot> Run<R> {
    /// A robot at power-up. `timeline` is in the order of time; `period` is that of the gait, in cycles.
    pub fn new(robot: R, mut timeline: Vec<Event>, period: u64) -> Self {
        let observer = Observer::new(&robot, period);
        timeline.reverse();
        Run { robot, observer, impossible: Vec::new(), happened: Vec::new(), timeline, step_end: None }
    }

    /// Runs for 250 ms, or up to the next event or to `end` if that comes first, and lets what is due happen.
    /// Returns whether there is more to run, and can be.
    ///
    /// # Errors
    /// An event can't happen. It is kept in [`impossible`](Run::impossible), and the run may go on.
    pub fn step(&mut self, end: u64) -> Result<bool, Impossible> {
        self.step_until(end, u64::MAX)
    }

    /// As [`step`](Self::step), but pauses at `pause` if that comes before. A run with pauses is the same
    /// run, and is judged the same.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn step_until(&mut self, end: u64, pause: u64) -> Result<bool, Impossible> {
        let event = self.timeline.last().map_or(u64::MAX, |event| event.at);
        let step_end = (self.robot.now() + STEP).min(event).min(end);
        let step_end = *self.step_end.get_or_insert(step_end);
        self.run_until(step_end.min(pause));
        if pause < step_end && self.robot.trouble().is_none() {
            self.observer.hear(&mut self.robot);
            return Ok(true);
        }
        self.end_step();
        let now = self.robot.now();
        while let Some(event) = self.timeline.pop_if(|event| event.at <= now) {
            if let Err(why) = self.happen(event.change.clone()) {
                let impossible = Impossible { event, why };
                self.impossible.push(impossible.clone());
                return Err(impossible);
            }
        }
        Ok(now < end && self.robot.trouble().is_none())
    }

    /// Lets something happen to the robot now, as if it stood in the timeline.
    ///
    /// # Errors
    /// It can't happen.
    pub fn happen(&mut self, change: Change) -> Result<(), WiringError> {
        if self.step_end.is_some() {
            self.end_step();
        }
        self.robot.change(&change)?;
        let event = Event { at: self.robot.now(), change };
        self.observer.changed(&event);
        self.happened.push(event);
        Ok(())
    }

    fn end_step(&mut self) {
        self.step_end = None;
        self.observer.look(&mut self.robot);
    }

    /// Records what the robot does from now on, and looks at it once in so many cycles. Call it at power-up.
    pub fn record(&mut self, every: u64) {
        let mut recorder = Recorder::new(&self.robot, every);
        recorder.look(&self.robot);
        self.observer.recorder = Some(recorder);
    }

    /// The recording; `None` if there is none.
    pub fn finish_recording(&mut self) -> Option<Recording> {
        self.observer.recorder.take().map(Recorder::finish)
    }

    /// Runs the robot, with stops where the recorder looks at it: these change nothing.
    fn run_until(&mut self, cycle: u64) {
        while let Some(recorder) = &mut self.observer.recorder
            && recorder.next_look() <= cycle
        {
            self.robot.run_until(recorder.next_look());
            if self.robot.now() < recorder.next_look() {
                // It can't go on.
                return;
            }
            recorder.look(&self.robot);
        }
        self.robot.run_until(cycle);
    }

    /// The events that have happened to it from outside so far, in order.
    pub fn happened(&self) -> &[Event] {
        &self.happened
    }

    /// The events of its timeline that are still to happen, in order.
    pub fn events_to_come(&self) -> impl ExactSizeIterator<Item = &Event> {
        self.timeline.iter().rev()
    }
}
