//! Random scripts.

use std::{array, iter};

use fastrand::Rng;
use kernel::{LONGEST, Priority, Ticks};

use crate::call::{Call, Group};
use crate::referee::Script;
use crate::reference::Reference;
use crate::setup::Setup;
use crate::step::{Handler, Interruption, Step};
use crate::world::{JOBS_IN_ALL, MUTEXES, QUEUES, SEMAPHORES, TIMERS};

use Priority::{P0, P1, P2, P3, P4, P5, P6, P7};

const PRIORITIES: [Priority; 8] = [P0, P1, P2, P3, P4, P5, P6, P7];

impl Setup {
    /// A random setup of up to `tasks` tasks, many of equal priority, and few objects, so that tasks meet
    /// there. It lacks the calls of `without`.
    pub fn random(rng: &mut Rng, tasks: usize, without: Option<Group>) -> Self {
        let highest = rng.usize(0..PRIORITIES.len());
        let lowest = rng.usize(highest..PRIORITIES.len());
        let priorities = several(rng, 1, tasks, |rng| PRIORITIES[rng.usize(highest..=lowest)]);
        let semaphores = several(rng, 1, SEMAPHORES, |rng| match rng.u8(..32) {
            0 => 254,
            few => few % 2,
        });
        let setup = Setup {
            started: rng.usize(1..=priorities.len()),
            jobs: several(rng, 2, JOBS_IN_ALL, |rng| rng.usize(..semaphores.len())),
            priorities,
            semaphores,
            // Some ceilings are lower than tasks that lock the mutex.
            ceilings: several(rng, 1, MUTEXES, |rng| {
                PRIORITIES[rng.usize(highest.saturating_sub(1)..=lowest)]
            }),
            rooms: several(rng, 1, QUEUES, |rng| rng.u8(0..4)),
            timers: rng.usize(1..=TIMERS),
            without,
            boot: Vec::new(),
        };
        let most = if without == Some(Group::Bytes) { 0 } else { *one_of(rng, &[0, 4]) };
        let mut calls = Random::new(rng.fork(), setup.clone(), 0, sections);
        Setup { boot: several(rng, 0, most, |_| calls.one_that_is_there(Random::call_of_thread)), ..setup }
    }
}

/// Draws how far inside of a call an interrupt comes, in the unit of [`Interruption::after`].
pub type Reach = fn(&mut Rng) -> usize;

/// A number of critical sections that most calls have.
pub fn sections(rng: &mut Rng) -> usize {
    rng.usize(1..10)
}

/// A number of cycles that most calls take; small numbers are more frequent.
pub fn cycles(rng: &mut Rng) -> usize {
    let most = 1000 >> rng.u8(..4);
    rng.usize(..most)
}

/// A script of random steps. Each script leaves out some calls, so that the others meet more often.
pub struct Random {
    rng: Rng,
    /// The calls that the script has, a bit each: of a task's, of a thread's, of any context's.
    of_task: u32,
    of_thread: u32,
    of_any: u32,
    setup: Setup,
    left: usize,
    reach: Reach,
}

impl Random {
    pub fn new(mut rng: Rng, setup: Setup, steps: usize, reach: Reach) -> Self {
        let [of_task, of_thread, of_any] = array::from_fn(|_| rng.u32(..));
        Random { rng, of_task, of_thread, of_any, setup, left: steps, reach }
    }

    /// The next call of the running task.
    fn call(&mut self, reference: &Reference) -> Call {
        match reference.way_out() {
            Some(Call::EndJob) if self.rng.u8(..4) > 0 => self.call_of_thread(),
            Some(call) => call,
            None => self.call_of_task(reference),
        }
    }

    /// Draws until the setup has the call.
    fn one_that_is_there(&mut self, mut draw: impl FnMut(&mut Self) -> Call) -> Call {
        loop {
            let call = draw(self);
            if self.setup.has(call) {
                return call;
            }
        }
    }

    fn call_of_task(&mut self, reference: &Reference) -> Call {
        let semaphore = self.semaphore();
        let queue = self.queue();
        match draw(&mut self.rng, self.of_task, 33) {
            0..2 => Call::Wait { semaphore },
            2 => Call::WaitTimeout { semaphore, ticks: self.ticks() },
            3..6 => Call::Lock { mutex: self.mutex() },
            6 => Call::WaitAny(self.flags()),
            7 => Call::WaitAll(self.flags()),
            8 => Call::Receive { queue },
            9 => Call::ReceiveTimeout { queue, ticks: self.ticks() },
            10 => Call::DropMessages,
            11 => Call::Yield,
            12 => Call::Delay(self.ticks().min(LONGEST)), // the kernel splits a longer delay into two
            13 => Call::DelayUntil(reference.ticks().wrapping_add(self.ticks())),
            14 => Call::StartPeriod(self.rng.u16(..5)),
            15 => Call::WaitForPeriod,
            16 => Call::Make { value: self.rng.u8(..) },
            17 => Call::SendMade { queue },
            18..20 => Call::WaitForSeveral { semaphores: array::from_fn(|_| self.semaphore()) },
            20 => Call::RunJobs { jobs: array::from_fn(|_| self.rng.usize(..self.setup.jobs.len())) },
            21 => Call::PipePut(self.rng.u8(..)),
            22 => Call::PipePutTimeout { byte: self.rng.u8(..), ticks: self.ticks() },
            23 => Call::PipeTake,
            24 => Call::PipeTakeTimeout { ticks: self.ticks() },
            25 => Call::TryLock { mutex: self.mutex() },
            26 => Call::LockTimeout { mutex: self.mutex(), ticks: self.ticks() },
            27 => Call::WaitAnyTimeout { flags: self.flags(), ticks: self.ticks() },
            28 => Call::WaitAllTimeout { flags: self.flags(), ticks: self.ticks() },
            29 => Call::WaitForSeveralTimeout {
                semaphores: array::from_fn(|_| self.semaphore()),
                ticks: self.ticks(),
            },
            30 if self.rng.u8(..3) == 0 => Call::Exit,
            _ => self.call_of_thread(),
        }
    }

    fn call_of_thread(&mut self) -> Call {
        let semaphore = self.semaphore();
        let timer = self.rng.usize(..self.setup.timers);
        let task = self.task();
        match draw(&mut self.rng, self.of_thread, 14) {
            0..2 => Call::StartTimer { timer, ticks: self.ticks(), semaphore },
            2 => Call::CancelTimer { timer },
            3..5 => Call::Suspend { task },
            5..7 => Call::SetPriority { task, priority: self.priority() },
            7 => Call::State { task },
            8 => Call::Kill { task },
            _ => self.call_of_any(),
        }
    }

    fn call_of_any(&mut self) -> Call {
        let semaphore = self.semaphore();
        let queue = self.queue();
        let timer = self.rng.usize(..self.setup.timers);
        let task = self.task();
        match draw(&mut self.rng, self.of_any, 23) {
            0..4 => Call::Post { semaphore },
            4 => Call::TryWait { semaphore },
            5..7 => Call::SetFlags(self.flags()),
            7 => Call::TakeFlags(self.flags()),
            8..11 => Call::Send { queue, value: self.rng.u8(..) },
            11 => Call::TryReceive { queue },
            12 => *one_of(&mut self.rng, &[Call::Refused { queue }, Call::PoolExhausted, Call::PoolMostUsed]),
            13 => Call::FifoPut(self.rng.u8(..)),
            14 => Call::FifoTake,
            15 => *one_of(
                &mut self.rng,
                &[Call::FifoPeek, Call::FifoLength, Call::FifoSpace, Call::FifoFlush, Call::FifoOverruns],
            ),
            16..18 => Call::PipeTryPut(self.rng.u8(..)),
            18..20 => Call::PipeTryTake,
            20 => *one_of(
                &mut self.rng,
                &[Call::PipePeek, Call::PipeLength, Call::PipeSpace, Call::PipeFlush, Call::PipeOverruns],
            ),
            21 => *one_of(
                &mut self.rng,
                &[Call::Now, Call::Start { task }, Call::Priority { task }, Call::TimerIsRunning { timer }],
            ),
            _ => Call::Resume { task },
        }
    }

    fn semaphore(&mut self) -> usize {
        self.rng.usize(..self.setup.semaphores.len())
    }

    fn mutex(&mut self) -> usize {
        self.rng.usize(..self.setup.ceilings.len())
    }

    fn queue(&mut self) -> usize {
        self.rng.usize(..self.setup.rooms.len())
    }

    fn task(&mut self) -> usize {
        self.rng.usize(..self.setup.priorities.len())
    }

    /// A priority that a task has at the start.
    fn priority(&mut self) -> Priority {
        *one_of(&mut self.rng, &self.setup.priorities)
    }

    /// Rarely more than one or two flags.
    fn flags(&mut self) -> u8 {
        self.rng.u8(..) & self.rng.u8(..) & self.rng.u8(..)
    }

    /// Mostly few ticks, so that deadlines coincide.
    fn ticks(&mut self) -> Ticks {
        match self.rng.u16(..2000) {
            0 => LONGEST,
            1 => LONGEST + 1,
            2 => self.rng.u16(..),
            few => few % 6,
        }
    }

    /// The actions of an interrupt.
    pub fn handler(&mut self) -> Handler {
        if self.rng.u8(..4) == 0 {
            return self.tick();
        }
        let number = *one_of(&mut self.rng, &[1, 1, 1, 2, 4]);
        Handler::Calls((0..number).map(|_| self.one_that_is_there(Self::call_of_any)).collect())
    }

    /// A tick. Inside of half of them another interrupt comes.
    fn tick(&mut self) -> Handler {
        if self.rng.bool() {
            return Handler::Tick(None);
        }
        let interruption = self.interruption();
        Handler::Tick(Some(Box::new(interruption)))
    }

    /// An interrupt inside of `call`, for half of all calls.
    fn interruption_into(&mut self, call: Call) -> Option<Interruption> {
        // `Send` makes two calls of the kernel.
        if matches!(call, Call::Send { .. }) || self.rng.bool() {
            return None;
        }
        Some(self.interruption())
    }

    /// An interrupt. Every third is followed by another one.
    fn interruption(&mut self) -> Interruption {
        let then = self.rng.u8(..3) == 0;
        Interruption {
            after: (self.reach)(&mut self.rng),
            handler: self.handler(),
            then: then.then(|| Box::new(self.interruption())),
        }
    }
}

impl Script for Random {
    fn next(&mut self, reference: &Reference) -> Option<Step> {
        self.left = self.left.checked_sub(1)?;
        if self.rng.u8(..5) == 0 {
            return Some(Step::Interrupt(self.handler()));
        }
        if reference.running().is_some() {
            let calls = iter::repeat_with(|| self.one_that_is_there(|random| random.call(reference)));
            let call = { calls }.find(|&call| reference.permits(call))?;
            return Some(Step::Call(call, self.interruption_into(call)));
        }
        Some(match self.rng.u16(..4000) {
            // Long enough for the clock to wrap.
            0 => Step::Silence(u16::MAX),
            1..2000 => Step::Interrupt(self.tick()),
            _ => Step::Interrupt(self.handler()),
        })
    }
}

/// A random number below `end` whose bit is set in `those`. The last number is always possible.
fn draw(rng: &mut Rng, those: u32, end: u8) -> u8 {
    loop {
        let number = rng.u8(..end);
        if number + 1 == end || those & 1 << number != 0 {
            return number;
        }
    }
}

fn several<T>(rng: &mut Rng, least: usize, most: usize, draw: impl FnMut(&mut Rng) -> T) -> Vec<T> {
    let number = rng.usize(least..=most);
    let mut draw = draw;
    (0..number).map(|_| draw(rng)).collect()
}

fn one_of<'a, T>(rng: &mut Rng, choices: &'a [T]) -> &'a T {
    &choices[rng.usize(..choices.len())]
}
