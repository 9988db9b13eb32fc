//! Plays a script on the MCU and on the reference, step by step.

use std::collections::VecDeque;

use model::call::{Call, Outcome};
use model::referee::{Complaint, Disagreement, Played, Referee, Script};
use model::reference::{Reference, TaskId};
use model::setup::Setup;
use model::step::{Handler, Interruption, Step};
use model::wire::Command;
use simavr_harness::Mcu;

use super::chip::{Boundary, Chip, Stop, Subject};

/// The most ticks that come before a task asks for its next command, or no task runs. On a board ticks are
/// 16,000 cycles apart, more than any call takes.
const MOST_TICKS: usize = 3;

/// Counts of what was played.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub sequences: u64,
    pub calls: u64,
    pub interrupts: u64,
    /// The interrupts that came between the beginning of a call and its end.
    pub inside: u64,
}

impl Counts {
    pub fn and(self, other: Counts) -> Counts {
        Counts {
            sequences: self.sequences + other.sequences,
            calls: self.calls + other.calls,
            interrupts: self.interrupts + other.interrupts,
            inside: self.inside + other.inside,
        }
    }
}

/// An MCU that asks for its arrangement.
pub struct Player<'a> {
    pub subject: &'a Subject,
    pub mcu: Mcu,
    pub counts: Counts,
}

/// The boundaries at which an interrupt can come inside of the call with step number `step`.
pub struct Probe {
    pub step: usize,
    pub boundaries: Vec<Boundary>,
}

impl<'a> Player<'a> {
    pub fn new(subject: &'a Subject) -> Self {
        Player { subject, mcu: subject.mcu(), counts: Counts::default() }
    }

    /// Plays `script` with the objects of `real`, and on a reference with those of `supposed`, which should
    /// be the same. Then takes the MCU back to where it was. Returns the script, and what was played.
    pub fn play<S: Script>(
        &mut self,
        real: &Setup,
        supposed: &Setup,
        script: S,
        probe: Option<&mut Probe>,
    ) -> (S, Result<Played, Box<Disagreement>>) {
        let Player { subject, mcu, counts } = self;
        counts.sequences += 1;
        let (script, result) = mcu.explore(|mcu| {
            let chip = Chip::new(subject, mcu, &real.arrangement());
            let referee = Referee::new(supposed, script);
            Lockstep::new(chip, referee, real.all_observations(), probe, counts).play(&real.boot)
        });
        counts.calls += result.as_ref().map_or(0, |played| played.calls);
        (script, result)
    }
}

struct Lockstep<'a, S> {
    chip: Chip<'a>,
    referee: Referee<S>,
    observations: Vec<Call>,
    /// The interrupts that will come inside of the call in progress, each so many cycles after the one
    /// before.
    to_come: VecDeque<(usize, Handler)>,
    /// The cycle from which the first of these counts: when the call began, or when the interrupt before was
    /// over.
    since: Option<u64>,
    /// Whether a tick has come whose due events may have happened or not.
    is_in_tick: bool,
    /// How many more ticks come while no task runs.
    silence: u16,
    /// The task that the last interrupt preempted, if it has not asked for a command since.
    last: Option<TaskId>,
    /// Steps so far.
    steps: usize,
    probe: Option<&'a mut Probe>,
    counts: &'a mut Counts,
}

impl<'a, S: Script> Lockstep<'a, S> {
    fn new(
        chip: Chip<'a>,
        referee: Referee<S>,
        observations: Vec<Call>,
        probe: Option<&'a mut Probe>,
        counts: &'a mut Counts,
    ) -> Self {
        Lockstep {
            chip,
            referee,
            observations,
            to_come: VecDeque::new(),
            since: None,
            is_in_tick: false,
            silence: 0,
            last: None,
            steps: 0,
            probe,
            counts,
        }
    }

    /// Plays the whole script.
    fn play(mut self, boot: &[Call]) -> (S, Result<Played, Box<Disagreement>>) {
        let result = self.boot(boot).and_then(|()| self.run());
        self.referee.finish(result)
    }

    /// Makes the calls before the kernel runs.
    fn boot(&mut self, calls: &[Call]) -> Result<(), Complaint> {
        self.handler_asks()?;
        for &call in calls {
            let outcome = self.call_of_handler(call)?;
            self.referee.booted(call, outcome)?;
        }
        self.chip.command_handler(Command::Leave);
        Ok(())
    }

    fn run(&mut self) -> Result<(), Complaint> {
        loop {
            let until = self.since.zip(self.to_come.front()).map(|(since, (after, _))| since + *after as u64);
            match self.chip.run(until)? {
                Stop::Task(id) => self.task_asks(id)?,
                Stop::Begins => self.begin(),
                Stop::Late => self.interrupt_inside()?,
                Stop::Asleep => {
                    if !self.falls_asleep()? {
                        return Ok(());
                    }
                }
                Stop::Handler => return Err("a handler runs, but no interrupt has come".into()),
            }
        }
    }

    /// The call in progress begins.
    fn begin(&mut self) {
        self.since = Some(self.chip.cycle());
        if let Some(probe) = self.probe.as_mut().filter(|probe| probe.step + 1 == self.steps) {
            probe.boundaries = self.chip.boundaries();
        }
    }

    /// The next step.
    fn next(&mut self, who: Option<TaskId>) -> Result<Option<Step>, Complaint> {
        self.steps += 1;
        self.referee.next(who)
    }

    /// A task asks for a command.
    fn task_asks(&mut self, id: TaskId) -> Result<(), Complaint> {
        self.arrive();
        if let Some(outcome) = self.chip.reply_of_task(id) {
            self.referee.returned(id, outcome)?;
        }
        match self.next(Some(id))? {
            Some(Step::Call(call, interruption)) => {
                self.chip.command_task(id, Command::Call(call));
                self.will_come(interruption, MOST_TICKS);
            }
            Some(Step::Interrupt(handler)) => {
                self.chip.command_task(id, Command::Ask);
                self.interrupt_and_more(handler)?;
            }
            Some(Step::Silence(_)) => self.chip.command_task(id, Command::Ask),
            None => {
                self.chip.command_task(id, Command::Leave);
                self.referee.each(Reference::leave);
            }
        }
        Ok(())
    }

    /// No task runs. Returns whether the script continues.
    fn falls_asleep(&mut self) -> Result<bool, Complaint> {
        let silence = self.silence;
        self.arrive();
        if silence > 0 && !self.referee.may_run() {
            self.silence = silence - 1;
            self.interrupt(&Handler::Tick(None))?;
            return Ok(true);
        }
        match self.next(None)? {
            Some(Step::Call(call, _)) => unreachable!("no task runs that could make {call:?}"),
            Some(Step::Interrupt(handler)) => self.interrupt_and_more(handler)?,
            Some(Step::Silence(ticks)) => self.silence = ticks,
            None => {
                let calls = self.observations.clone();
                self.interrupt(&Handler::Calls(calls))?;
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The program asks for a command, or no task runs, so no more interrupts of the last step come.
    fn arrive(&mut self) {
        self.end_tick();
        self.to_come.clear();
        self.since = None;
        self.silence = 0;
        self.last = None;
    }

    /// The events due by the last tick have happened.
    fn end_tick(&mut self) {
        if std::mem::take(&mut self.is_in_tick) {
            self.referee.each(Reference::fire);
        }
    }

    /// Raises an interrupt at once, and schedules those inside of it.
    fn interrupt_and_more(&mut self, handler: Handler) -> Result<(), Complaint> {
        if let Handler::Tick(Some(interruption)) = &handler {
            self.will_come(Some((**interruption).clone()), MOST_TICKS - 1);
        }
        self.interrupt(&handler)?;
        self.since = Some(self.chip.cycle());
        Ok(())
    }

    fn interrupt_inside(&mut self) -> Result<(), Complaint> {
        let Some((_, handler)) = self.to_come.pop_front() else { return Ok(()) };
        self.counts.inside += 1;
        self.interrupt(&handler)?;
        self.since = Some(self.chip.cycle());
        Ok(())
    }

    /// Schedules interrupts, with at most so many ticks among them.
    fn will_come(&mut self, interruption: Option<Interruption>, most_ticks: usize) {
        self.to_come = chain(interruption);
        let mut ticks = 0;
        self.to_come.retain(|(_, handler)| {
            ticks += usize::from(matches!(handler, Handler::Tick(_)));
            matches!(handler, Handler::Calls(_)) || ticks <= most_ticks
        });
    }

    /// Raises an interrupt. Unless it is a tick, its handler also ends here; other interrupts may come inside
    /// of a tick.
    fn interrupt(&mut self, handler: &Handler) -> Result<(), Complaint> {
        self.counts.interrupts += 1;
        let preempted = match handler {
            Handler::Tick(_) => self.chip.tick()?,
            Handler::Calls(_) => self.chip.press()?,
        };
        if let Some(id) = preempted {
            self.end_tick();
            let is_still_there = self.last == preempted;
            self.referee.branch(|reference| ways_in_task(reference, id, is_still_there))?;
            self.last = preempted;
        } else {
            let is_in_tick = self.is_in_tick;
            self.referee.branch(|reference| ways_in_kernel(reference, is_in_tick))?;
        }
        match handler {
            Handler::Tick(_) => {
                self.referee.each(Reference::pass);
                self.is_in_tick = true;
                Ok(())
            }
            Handler::Calls(calls) => self.handle(calls),
        }
    }

    /// The handler of the external interrupt makes these calls.
    fn handle(&mut self, calls: &[Call]) -> Result<(), Complaint> {
        self.handler_asks()?;
        let outcomes: Result<Vec<_>, _> = calls.iter().map(|&call| self.call_of_handler(call)).collect();
        self.referee.handled(calls, &outcomes?)?;
        self.chip.command_handler(Command::Leave);
        Ok(())
    }

    /// Makes the handler, which asks for a command, make this call, and runs until it asks again.
    fn call_of_handler(&mut self, call: Call) -> Result<Outcome, Complaint> {
        self.chip.command_handler(Command::Call(call));
        self.handler_asks()?;
        self.chip.reply_of_handler().ok_or_else(|| format!("the handler's {call:?} returns nothing"))
    }

    fn handler_asks(&mut self) -> Result<(), Complaint> {
        loop {
            match self.chip.run(None)? {
                Stop::Begins => {}
                Stop::Handler => return Ok(()),
                stop => return Err(format!("{stop:?} where the handler should ask for its next call")),
            }
        }
    }
}

/// The interrupts of `interruption`, each after the one in which, or after which, it comes.
fn chain(mut interruption: Option<Interruption>) -> VecDeque<(usize, Handler)> {
    let mut all = VecDeque::new();
    while let Some(Interruption { after, handler, then }) = interruption {
        let inside = match &handler {
            Handler::Tick(inside) => inside.as_deref().cloned(),
            Handler::Calls(_) => None,
        };
        all.push_back((after, handler));
        all.extend(chain(inside));
        interruption = then.map(|then| *then);
    }
    all
}

/// The possible states when an interrupt preempts task `id`. If the last interrupt preempted the same task
/// (`is_still_there`), the task may have blocked before that one and not switched yet.
fn ways_in_task(reference: &Reference, id: TaskId, is_still_there: bool) -> Vec<Reference> {
    let mut ways = reference.interrupted_in_call(id);
    ways.extend(is_still_there.then(|| reference.clone()));
    ways
}

/// The possible states when an interrupt preempts the kernel itself, after a tick or inside of one.
fn ways_in_kernel(reference: &Reference, is_in_tick: bool) -> Vec<Reference> {
    if !is_in_tick {
        return reference.interrupted_in_kernel();
    }
    let mut ways = reference.interrupted_at_tick();
    let mut over = reference.clone();
    over.fire();
    ways.extend(over.interrupted_in_kernel());
    ways
}
