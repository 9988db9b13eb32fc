//! The joints' task (paper, section 5): one on each MCU, the highest of all, woken each millisecond while a joint moves.

use kernel::{Mutex, Never, Priority, Semaphore, Task, Ticks};

use super::joint::{Joint, Reading, State};
use crate::device::JointMotors;

/// The joints of one MCU. A `static`: their task runs on it, and readers of RAM find the [`Counters`] at its start.
#[repr(C)]
pub struct Motors<const N: usize> {
    control: Mutex<Control<N>>,
    /// Posted with each order.
    order: Semaphore,
    /// Posted each millisecond while a joint is controlled.
    period: Semaphore,
}

/// What the joints' task counts. Both wrap.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Counters {
    /// Periods in which the joints were controlled.
    pub periods: u16,
    /// Periods that passed before the one before was done.
    pub missed: u16,
}

#[repr(C)]
struct Control<const N: usize> {
    counters: Counters,
    joints: [Joint; N],
}

impl<const N: usize> Motors<N> {
    /// Joints that are off.
    pub const fn new(joints: [Joint; N]) -> Self {
        let counters = Counters { periods: 0, missed: 0 };
        Motors {
            control: Mutex::new(Priority::P0, Control { counters, joints }),
            order: Semaphore::new(0),
            period: Semaphore::new(0),
        }
    }

    /// Gives an order to the joint with this index, or looks at it. `None` if there is no such joint here.
    pub fn with<R>(&self, task: &mut Task, index: usize, work: impl FnOnce(&mut Joint) -> R) -> Option<R> {
        let result = self.control.with(task, |control| control.joints.get_mut(index).map(work));
        self.order.post(task);
        result
    }

    /// What the joint with this index is doing.
    pub fn state(&self, task: &mut Task, index: usize) -> Option<State> {
        self.control.with(task, |control| control.joints.get(index).map(Joint::state))
    }

    /// What the task counts.
    pub fn counters(&self, task: &mut Task) -> Counters {
        self.control.with(task, |control| control.counters)
    }
}

/// What came of a period.
struct Outcome<const N: usize> {
    drives: [i16; N],
    is_at_rest: bool,
    is_news: bool,
}

impl<const N: usize> Control<N> {
    fn is_at_rest(&self) -> bool {
        self.joints.iter().all(Joint::is_at_rest)
    }

    fn watch(&mut self, readings: [Reading; N]) {
        for (joint, reading) in self.joints.iter_mut().zip(readings) {
            joint.watch(reading);
        }
    }

    #[inline(always)]
    fn step(&mut self, readings: [Reading; N], missed: u16) -> Outcome<N> {
        self.counters.periods = self.counters.periods.wrapping_add(1);
        self.counters.missed = self.counters.missed.wrapping_add(missed);
        let mut outcome = Outcome { drives: [0; N], is_at_rest: true, is_news: false };
        for ((joint, reading), drive) in self.joints.iter_mut().zip(readings).zip(&mut outcome.drives) {
            let before = joint.state();
            *drive = joint.step(reading);
            outcome.is_at_rest &= joint.is_at_rest();
            outcome.is_news |= joint.state() != before;
        }
        outcome
    }
}

/// How often joints at rest are looked at, in ticks of 1 ms.
const WATCH: Ticks = 16;

/// Runs the task of `motors`. `news` is posted when a joint has changed its state by itself.
///
/// Joints that are at rest need no computing: their drives stay as they are. They are looked at now and then, and controlled
/// again as soon as one is moved or told to.
pub fn run<const N: usize>(
    task: &mut Task,
    motors: &'static Motors<N>,
    mut devices: impl JointMotors<N>,
    news: &'static Semaphore,
) -> Never {
    loop {
        rest(task, motors, &mut devices);
        devices.begin(task, &motors.period);
        motors.period.wait(task); // until the joints have been measured once
        let mut is_at_rest = false;
        while !is_at_rest {
            motors.period.wait(task);
            let mut missed = 0;
            while motors.period.try_wait(task) {
                missed += 1;
            }
            let readings = devices.readings(task);
            let outcome = motors.control.with(task, |control| control.step(readings, missed));
            devices.drive(outcome.drives);
            if outcome.is_news {
                news.post(task);
            }
            is_at_rest = outcome.is_at_rest;
        }
        devices.end(task);
    }
}

/// Waits until a joint has to be controlled.
fn rest<const N: usize>(task: &mut Task, motors: &'static Motors<N>, devices: &mut impl JointMotors<N>) {
    while motors.order.try_wait(task) {} // those that have been carried out
    while motors.control.with(task, |control| control.is_at_rest()) {
        devices.look(task);
        if motors.order.wait_timeout(task, WATCH).is_err() {
            let readings = devices.readings(task);
            motors.control.with(task, |control| control.watch(readings));
        }
    }
}
