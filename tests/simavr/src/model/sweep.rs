//! An interrupt at instruction boundaries inside of one call of a script: at every sixteenth boundary,
//! beginning with any of the first sixteen.
//!
//! The possible states inside of the call have an order in time. Later interrupts must agree with states that
//! are not earlier.

use std::collections::BTreeMap;

use model::call::Call;
use model::referee::Disagreement;
use model::reference::TaskId;
use model::setup::Setup;
use model::shorten::Replay;
use model::step::{Handler, Interruption, Step};

use super::chip::Boundary;
use super::lockstep::{Player, Probe};

/// A script's call, and the interrupt's actions.
pub struct Sweep<'a, 'p> {
    pub player: &'a mut Player<'p>,
    pub real: &'a Setup,
    pub supposed: &'a Setup,
    /// The number of the step that is the call. If that step is no call, nothing is swept.
    pub step: usize,
    pub handler: Handler,
    /// The first boundary, below [`STRIDE`].
    pub first: usize,
}

/// One in so many boundaries is tried.
pub const STRIDE: usize = 16;

/// The same, without interrupts inside.
fn without_interruptions(step: &Step) -> Step {
    match step {
        Step::Call(call, _) => Step::Call(*call, None),
        Step::Interrupt(handler) => Step::Interrupt(plain(handler)),
        Step::Silence(ticks) => Step::Silence(*ticks),
    }
}

/// The same, without interrupts inside.
fn plain(handler: &Handler) -> Handler {
    match handler {
        Handler::Tick(_) => Handler::Tick(None),
        Handler::Calls(calls) => Handler::Calls(calls.clone()),
    }
}

impl Sweep<'_, '_> {
    /// Sweeps the call in a script of these steps without their interrupts inside of calls, as far as they
    /// are possible.
    ///
    /// # Errors
    /// The script that disagrees.
    pub fn run(self, steps: &[Step]) -> Result<(), Box<Disagreement>> {
        let mut probe = Probe { step: self.step, boundaries: Vec::new() };
        let script = Replay::new(steps.iter().map(without_interruptions).collect());
        let played = self.player.play(self.real, self.supposed, script, Some(&mut probe)).1?;
        let steps: Vec<_> = played.steps().cloned().collect();
        // Making a message and sending it are two calls of the kernel.
        let Some(&Step::Call(call, _)) = steps.get(self.step) else { return Ok(()) };
        if matches!(call, Call::Send { .. }) {
            return Ok(());
        }
        // The recorded states are those of the last interrupt, so there may be only one inside of the call.
        let handler = plain(&self.handler);
        // By preempted task: the earliest state that is still possible, and the place of the last interrupt.
        let mut reached: BTreeMap<Option<TaskId>, (u32, usize)> = BTreeMap::new();
        for Boundary { after, task } in probe.boundaries.into_iter().skip(self.first).step_by(STRIDE) {
            let mut steps = steps.clone();
            let interruption = Interruption { after, handler: handler.clone(), then: None };
            steps[self.step] = Step::Call(call, Some(interruption));
            let played = self.player.play(self.real, self.supposed, Replay::new(steps), None).1?;
            let (way, before) = reached.entry(task).or_insert((0, after));
            let later = played.ways >> *way;
            if later == 0 {
                let what = format!(
                    "an interrupt {after} cycles into {call:?} comes as if earlier than one {before} cycles into it"
                );
                return Err(played.disagree(what));
            }
            *way += later.trailing_zeros();
            *before = after;
        }
        Ok(())
    }
}
