//! Every script up to a length, one after the other.

use kernel::Priority;

use crate::call::{Call, Setup, Step};
use crate::lockstep::Script;
use crate::reference::Reference;

/// All scripts of so many steps. They are told apart by which of the possible steps they take each time, and they come in
/// the order of these numbers, as an odometer counts.
pub struct Exhaustive {
    length: usize,
    wheels: Vec<Wheel>,
    /// The next wheel to be read.
    at: usize,
    /// How many scripts have been played.
    pub played: u64,
}

struct Wheel {
    choice: usize,
    choices: usize,
}

impl Exhaustive {
    pub fn new(length: usize) -> Self {
        Exhaustive { length, wheels: Vec::new(), at: 0, played: 0 }
    }
}

impl Script for Exhaustive {
    fn next(&mut self, reference: &Reference) -> Option<Step> {
        if self.at == self.length {
            return None;
        }
        let mut steps = possible_steps(reference);
        if self.at == self.wheels.len() {
            self.wheels.push(Wheel { choice: 0, choices: steps.len() });
        }
        let choice = self.wheels[self.at].choice;
        self.at += 1;
        Some(steps.swap_remove(choice))
    }

    fn goes_on(&mut self) -> bool {
        self.played += 1;
        self.at = 0;
        while let Some(mut wheel) = self.wheels.pop() {
            wheel.choice += 1;
            if wheel.choice < wheel.choices {
                self.wheels.push(wheel);
                return true;
            }
        }
        false
    }
}

/// Two semaphores, a mutex and a queue with room for one.
pub fn setup(priorities: [Priority; 3], ceiling: Priority) -> Setup {
    Setup {
        priorities: priorities.to_vec(),
        semaphores: vec![0, 0],
        ceilings: vec![ceiling],
        rooms: vec![1],
        timers: 0,
    }
}

/// What can happen in this state, on the objects of [`setup`].
fn possible_steps(reference: &Reference) -> Vec<Step> {
    let of_tasks = [
        Call::Wait { semaphore: 0 },
        Call::Wait { semaphore: 1 },
        Call::WaitTimeout { semaphore: 0, ticks: 1 },
        Call::Post { semaphore: 0 },
        Call::Post { semaphore: 1 },
        Call::Lock { mutex: 0 },
        Call::Unlock,
        Call::Send { queue: 0, value: 1 },
        Call::Receive { queue: 0 },
        Call::ReceiveTimeout { queue: 0, ticks: 1 },
        Call::Yield,
        Call::Delay(1),
    ];
    let of_interrupts =
        [Call::Post { semaphore: 0 }, Call::Post { semaphore: 1 }, Call::Send { queue: 0, value: 2 }];
    let calls = of_tasks.into_iter().filter(|&call| reference.permits(call)).map(Step::Call);
    let interrupts = of_interrupts.map(|call| Step::Interrupt(vec![call]));
    calls.chain(interrupts).chain([Step::Ticks(1)]).collect()
}
