//! The joints' control as turns of the loop; [`tasks::motor::task`] runs it as a task.

use kernel::{Semaphore, Task, Ticks, is_reached, now};
use tasks::device::JointMotors;
use tasks::motor::joint::Joint;
use tasks::motor::joints::{Awaited, Joints, WATCH};
use tasks::motor::task::{Here, Motors};

/// Joints, and the devices that drive and measure them.
pub struct Driver<J, const N: usize> {
    motors: &'static Motors<N>,
    joints: Joints<N>,
    devices: J,
    /// Whether an order has come that is not begun yet.
    is_ordered: bool,
    /// When joints at rest are looked at.
    look_at: Ticks,
    /// Posted when a joint has changed its state by itself.
    news: &'static Semaphore,
}

impl<J: JointMotors, const N: usize> Driver<J, N> {
    /// Joints that are off; see [`tasks::motor::task::run`].
    pub fn new(motors: &'static Motors<N>, joints: [Joint; N], devices: J, news: &'static Semaphore) -> Self {
        Driver { motors, joints: Joints::new(joints), devices, is_ordered: false, look_at: 0, news }
    }

    /// Takes a turn, because one of `motors` got an order, a period has begun, or the time has come. Returns
    /// the time of the next turn if nothing is posted before.
    #[inline(never)] // its stack is needed here alone
    pub fn turn(&mut self, task: &mut Task, is_ordered: bool, is_period: bool) -> Option<Ticks> {
        let Driver { motors, joints, devices, news, .. } = self;
        self.is_ordered |= is_ordered;
        match joints.awaited() {
            Awaited::OrderOrLook if self.is_ordered || is_reached(self.look_at, now(task)) => {
                self.look_at = now(task).wrapping_add(WATCH);
                let is_ordered = core::mem::take(&mut self.is_ordered);
                joints.order_or_look(is_ordered, &mut Here { task, motors, devices });
            }
            Awaited::Order if self.is_ordered => {
                self.is_ordered = false;
                joints.order_or_look(true, &mut Here { task, motors, devices });
            }
            Awaited::FirstPeriod if is_period => joints.first_period(&mut Here { task, motors, devices }),
            Awaited::Measurement if is_period => joints.measurement(&mut Here { task, motors, devices }),
            Awaited::Period if is_period => {
                self.look_at = now(task).wrapping_add(WATCH);
                let is_ordered = core::mem::take(&mut self.is_ordered);
                motors.control(task, joints, is_ordered, devices, news);
            }
            _ => {}
        }
        (self.joints.awaited() == Awaited::OrderOrLook).then_some(self.look_at)
    }
}
