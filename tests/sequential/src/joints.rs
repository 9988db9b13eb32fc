//! The joints' control in turns: what [`tasks::motor::task`] does as a task.

use kernel::{Semaphore, Task, Ticks, now};
use tasks::device::JointMotors;
use tasks::motor::joint::Joint;
use tasks::motor::task::{Motors, WATCH};

use crate::due::is_reached;

/// Joints, and what drives and measures them.
pub struct Driver<J, const N: usize> {
    motors: &'static Motors<N>,
    joints: [Joint; N],
    devices: J,
    phase: Phase,
    /// What is posted when a joint has changed its state by itself.
    news: &'static Semaphore,
}

#[derive(Clone, Copy)]
enum Phase {
    /// Nothing is driven.
    Off,
    /// At rest: what is driven is looked at then.
    Watched(Ticks),
    /// The joints are being measured for the first time.
    Begun,
    Controlled,
}

impl<J: JointMotors, const N: usize> Driver<J, N> {
    /// Joints that are off; see [`tasks::motor::task::run`].
    pub fn new(motors: &'static Motors<N>, joints: [Joint; N], devices: J, news: &'static Semaphore) -> Self {
        Driver { motors, joints, devices, phase: Phase::Off, news }
    }

    /// Has its turn: one of `motors` was ordered, or its period has begun, or it is time for it. Returns when
    /// it has another though nothing is posted.
    #[inline(never)] // its stack is needed here alone
    pub fn turn(&mut self, task: &mut Task, is_ordered: bool, is_period: bool) -> Option<Ticks> {
        match self.phase {
            Phase::Off | Phase::Watched(_) if is_ordered => self.begin(task),
            Phase::Watched(at) if is_reached(at, now(task)) => {
                for (index, joint) in self.joints.iter_mut().enumerate() {
                    joint.watch(self.devices.reading(task, index));
                }
                self.look(task);
            }
            Phase::Begun if is_period => {
                self.devices.done();
                self.phase = Phase::Controlled;
            }
            Phase::Controlled if is_period => {
                let Driver { motors, joints, devices, news, .. } = self;
                if !motors.control(task, joints, devices, news) {
                    self.devices.end(task);
                    self.look(task);
                }
            }
            _ => {}
        }
        match self.phase {
            Phase::Watched(at) => Some(at),
            Phase::Off | Phase::Begun | Phase::Controlled => None,
        }
    }

    /// Goes to rest, or on where a joint is not at rest.
    fn look(&mut self, task: &mut Task) {
        if !self.joints.iter().all(Joint::is_at_rest) {
            self.begin(task);
        } else if self.joints.iter().any(Joint::is_driven) {
            self.devices.look(task);
            self.phase = Phase::Watched(now(task).wrapping_add(WATCH));
        } else {
            self.phase = Phase::Off;
        }
    }

    fn begin(&mut self, task: &mut Task) {
        self.phase = Phase::Begun;
        self.devices.begin(task, self.motors.period());
    }
}
