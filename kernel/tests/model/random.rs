//! Scripts drawn by lot.

use std::iter;

use fastrand::Rng;
use kernel::{LONGEST, Priority, Ticks};

use crate::call::{Call, Handler, Setup, Step, Strike};
use crate::lockstep::Script;
use crate::reference::Reference;

use Priority::{P0, P1, P2, P3, P4, P5, P6, P7};

const PRIORITIES: [Priority; 8] = [P0, P1, P2, P3, P4, P5, P6, P7];

impl Setup {
    /// Up to six tasks, many of them equals, and few objects, so that tasks meet there.
    pub fn random(rng: &mut Rng) -> Self {
        let highest = rng.usize(0..PRIORITIES.len());
        let lowest = rng.usize(highest..PRIORITIES.len());
        let priorities = several(rng, 1, 6, |rng| PRIORITIES[rng.usize(highest..=lowest)]);
        Setup {
            started: rng.usize(1..=priorities.len()),
            priorities,
            semaphores: several(rng, 1, 3, |rng| *one_of(rng, &[0, 0, 1, 254])),
            // Some lower than tasks that lock it.
            ceilings: several(rng, 1, 2, |rng| PRIORITIES[rng.usize(highest.saturating_sub(1)..=lowest)]),
            rooms: several(rng, 1, 2, |rng| rng.u8(0..4)),
            timers: rng.usize(1..=3),
        }
    }
}

/// A number of steps drawn by lot. Each script does without some calls, so that others meet more often.
pub struct Random {
    rng: Rng,
    /// Which it has, of a task's and of all.
    of_task: u32,
    of_either: u32,
    setup: Setup,
    left: usize,
}

impl Random {
    pub fn new(mut rng: Rng, setup: Setup, steps: usize) -> Self {
        let (of_task, of_either) = (rng.u32(..), rng.u32(..));
        Random { rng, of_task, of_either, setup, left: steps }
    }

    fn call_of_task(&mut self, reference: &Reference) -> Call {
        if reference.is_in_section() {
            return Call::Unlock;
        }
        let semaphore = self.rng.usize(..self.setup.semaphores.len());
        let queue = self.rng.usize(..self.setup.rooms.len());
        let timer = self.rng.usize(..self.setup.timers);
        let task = self.rng.usize(..self.setup.priorities.len());
        match draw(&mut self.rng, self.of_task, 32) {
            0..2 => Call::Wait { semaphore },
            2 => Call::WaitTimeout { semaphore, ticks: self.ticks() },
            3..6 => Call::Lock { mutex: self.rng.usize(..self.setup.ceilings.len()) },
            6 => Call::WaitAny(self.flags()),
            7 => Call::WaitAll(self.flags()),
            8 => Call::Receive { queue },
            9 => Call::ReceiveTimeout { queue, ticks: self.ticks() },
            10 => Call::DropMessages,
            11 => Call::Yield,
            12 => Call::Delay(self.ticks()),
            13 => Call::DelayUntil(reference.ticks().wrapping_add(self.ticks())),
            14 => Call::StartPeriod(self.rng.u16(..5)),
            15 => Call::WaitForPeriod,
            16 => Call::Make { value: self.rng.u8(..) },
            17 => Call::SendMade { queue },
            18..20 => Call::StartTimer { timer, ticks: self.ticks(), semaphore },
            20 => Call::CancelTimer { timer },
            21..23 => Call::Suspend { task },
            23..25 => Call::SetPriority { task, priority: self.priority() },
            25 => Call::State { task },
            26 => *one_of(&mut self.rng, &[Call::Kill { task }, Call::Kill { task }, Call::Exit]),
            _ => self.call_of_either(),
        }
    }

    fn call_of_either(&mut self) -> Call {
        let semaphore = self.rng.usize(..self.setup.semaphores.len());
        let queue = self.rng.usize(..self.setup.rooms.len());
        let task = self.rng.usize(..self.setup.priorities.len());
        match draw(&mut self.rng, self.of_either, 18) {
            0..4 => Call::Post { semaphore },
            4 => Call::TryWait { semaphore },
            5..7 => Call::SetFlags(self.flags()),
            7 => Call::TakeFlags(self.flags()),
            8..11 => Call::Send { queue, value: self.rng.u8(..) },
            11 => Call::TryReceive { queue },
            12 => Call::Refused { queue },
            13 => *one_of(&mut self.rng, &[Call::PoolExhausted, Call::PoolMostUsed, Call::Overruns]),
            14 => Call::Put(self.rng.u8(..)),
            15 => Call::Take,
            16 => *one_of(&mut self.rng, &[Call::Now, Call::Start { task }]),
            _ => Call::Resume { task },
        }
    }

    /// One that a task has at the start.
    fn priority(&mut self) -> Priority {
        *one_of(&mut self.rng, &self.setup.priorities)
    }

    /// Seldom more than one or two flags.
    fn flags(&mut self) -> u8 {
        self.rng.u8(..) & self.rng.u8(..) & self.rng.u8(..)
    }

    /// Mostly so few that deadlines meet.
    fn ticks(&mut self) -> Ticks {
        match self.rng.u16(..200) {
            0 => LONGEST,
            1 => LONGEST + 1,
            2 => self.rng.u16(..),
            few => few % 6,
        }
    }

    fn handler(&mut self) -> Handler {
        if self.rng.u8(..4) == 0 {
            return self.tick();
        }
        let number = *one_of(&mut self.rng, &[1, 1, 1, 2, 4]);
        Handler::Calls((0..number).map(|_| self.call_of_either()).collect())
    }

    /// Another interrupt strikes inside of half of all.
    fn tick(&mut self) -> Handler {
        if self.rng.bool() {
            return Handler::Tick(None);
        }
        let strike = self.strike(6);
        Handler::Tick(Some(Box::new(strike)))
    }

    /// Strikes into half of all calls.
    fn strike_into(&mut self, call: Call) -> Option<Strike> {
        // This one is two calls of the kernel.
        if matches!(call, Call::Send { .. }) || self.rng.bool() {
            return None;
        }
        Some(self.strike(10))
    }

    /// Every third is followed by another.
    fn strike(&mut self, sections: usize) -> Strike {
        let then = self.rng.u8(..3) == 0;
        Strike {
            sections: self.rng.usize(1..sections),
            handler: self.handler(),
            then: then.then(|| Box::new(self.strike(6))),
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
            let call =
                iter::repeat_with(|| self.call_of_task(reference)).find(|&call| reference.permits(call))?;
            return Some(Step::Call(call, self.strike_into(call)));
        }
        Some(match self.rng.u16(..4000) {
            // So long that the clock wraps.
            0 => Step::Silence(u16::MAX),
            1..2000 => Step::Interrupt(self.tick()),
            _ => Step::Interrupt(self.handler()),
        })
    }
}

/// A number below `end` whose bit is set in `those`; the last is always among them.
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
