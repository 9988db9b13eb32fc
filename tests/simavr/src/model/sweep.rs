//! An interrupt at instruction boundaries inside of one call of a script: at every eighth, beginning with
//! any.
//!
//! Between two critical sections it must not matter where it comes: some way in which things may stand there
//! must agree with all that follows wherever it came.

use std::collections::BTreeMap;

use model::call::Call;
use model::referee::{Disagreement, Ways};
use model::reference::TaskId;
use model::setup::Setup;
use model::shorten::Replay;
use model::step::{Handler, Step, Strike};

use super::chip::Boundary;
use super::lockstep::{Player, Probe};

/// A script's call, and what the interrupt does.
pub struct Sweep<'a, 'p> {
    pub player: &'a mut Player<'p>,
    pub real: &'a Setup,
    pub supposed: &'a Setup,
    /// The number of the step that is the call; if it is none, nothing is swept.
    pub step: usize,
    pub handler: Handler,
    /// The first boundary, below [`STRIDE`].
    pub first: usize,
}

/// One of so many boundaries is tried.
pub const STRIDE: usize = 8;

/// The same without interrupts inside of it.
pub fn without_strikes(step: &Step) -> Step {
    match step {
        Step::Call(call, _) => Step::Call(*call, None),
        Step::Interrupt(handler) => Step::Interrupt(plain(handler)),
        Step::Silence(ticks) => Step::Silence(*ticks),
    }
}

/// The same without interrupts inside of it.
fn plain(handler: &Handler) -> Handler {
    match handler {
        Handler::Tick(_) => Handler::Tick(None),
        Handler::Calls(calls) => Handler::Calls(calls.clone()),
    }
}

impl Sweep<'_, '_> {
    /// Sweeps the call in a script of these steps, as far as they are possible.
    ///
    /// # Errors
    /// What disagrees.
    pub fn run(self, steps: Vec<Step>) -> Result<(), Box<Disagreement>> {
        let mut probe = Probe { step: self.step, boundaries: Vec::new() };
        let script = Replay::new(steps);
        let played = self.player.play(self.real, self.supposed, script, Some(&mut probe)).1?;
        let steps: Vec<_> = played.steps().cloned().collect();
        // To make a message and to send it are two calls of the kernel.
        let Some(&Step::Call(call, _)) = steps.get(self.step) else { return Ok(()) };
        if matches!(call, Call::Send { .. }) {
            return Ok(());
        }
        // The ways are those of the last interrupt: so there is but one inside of the call.
        let handler = plain(&self.handler);
        // The ways that agree wherever the interrupt came in a stretch, and the first place of it.
        let mut stretches: BTreeMap<(usize, Option<TaskId>), (Ways, usize)> = BTreeMap::new();
        for Boundary { after, stretch, task } in probe.boundaries.into_iter().skip(self.first).step_by(STRIDE)
        {
            let mut struck = steps.clone();
            struck[self.step] =
                Step::Call(call, Some(Strike { after, handler: handler.clone(), then: None }));
            let played = self.player.play(self.real, self.supposed, Replay::new(struck), None).1?;
            let (ways, first) = stretches.entry((stretch, task)).or_insert((Ways::MAX, after));
            *ways &= played.ways;
            if *ways == 0 {
                let what = format!(
                    "an interrupt {after} cycles into {call:?} does not what it does {first} cycles into it, \
                     with no critical section between"
                );
                return Err(played.disagree(what));
            }
        }
        Ok(())
    }
}
