//! The joints' task (paper, section 5): one on each MCU, with the highest priority of all, woken each
//! millisecond while a joint moves. It drives [their state machine](super::joints).

use kernel::{Context, Masked, MaskedCell, Never, Semaphore, Task, Ticks};

use super::joint::{Reading, State};
use super::joints::{Awaited, Joints, Order, Surroundings, WATCH};
use super::{Position, to_angle};
use crate::counter::{Counter, counters};
use crate::device::JointMotors;
use crate::duty::Duty;

/// The joints of one MCU as others see them. A `static`: their task runs on it, and readers of RAM find the
/// [`Counters`] at its start.
#[repr(C)]
pub struct Motors<const N: usize> {
    counters: Counters<Counter>,
    panels: [Panel; N],
    /// Posted with each order.
    ordered: Semaphore,
    /// Posted each millisecond while a joint is controlled.
    period: Semaphore,
    /// The duty of their task.
    duty: Duty,
}

counters! {
    /// The counts of the joints' task. Both wrap.
    pub struct Counters {
        /// Periods in which the joints were controlled.
        periods,
        /// Periods that passed before the one before was done.
        missed,
    }
}

/// Where a joint gets its orders, and shows its state and position.
struct Panel {
    order: MaskedCell<Option<Order>>,
    state: MaskedCell<State>,
    position: MaskedCell<Option<Position>>,
}

impl Panel {
    const fn new() -> Self {
        Panel {
            order: MaskedCell::new(None),
            state: MaskedCell::new(State::Off),
            position: MaskedCell::new(None),
        }
    }

    fn take(&self, masked: &Masked) -> Option<Order> {
        let order = self.order.get(masked);
        self.order.set(masked, None);
        order
    }
}

impl<const N: usize> Default for Motors<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Motors<N> {
    /// Joints that are off.
    pub const fn new() -> Self {
        Motors {
            counters: Counters::new(),
            panels: [const { Panel::new() }; N],
            ordered: Semaphore::new(0),
            period: Semaphore::new(0),
            duty: Duty::new(),
        }
    }

    /// Gives an order to the joint with this index. It replaces one that the joint has not begun with.
    pub fn order(&self, task: &mut Task, index: usize, order: Order) {
        let Some(panel) = self.panels.get(index) else { return };
        task.mask(|masked| {
            panel.order.set(masked, Some(order));
            panel.state.set(masked, order.state());
        });
        task.window();
        self.ordered.post(task);
    }

    /// The state of the joint with this index; `None` if there is no such joint here.
    pub fn state(&self, task: &mut Task, index: usize) -> Option<State> {
        let panel = self.panels.get(index)?;
        Some(task.mask(|masked| panel.state.get(masked)))
    }

    /// Where the joint with this index is, in 0.1 degree, as far as that is known.
    pub fn angle(&self, task: &mut Task, index: usize) -> Option<i16> {
        let panel = self.panels.get(index)?;
        task.mask(|masked| panel.position.get(masked)).map(to_angle)
    }

    /// Posted with each order.
    pub const fn ordered(&self) -> &Semaphore {
        &self.ordered
    }

    /// Posted each millisecond while a joint is controlled.
    pub const fn period(&self) -> &Semaphore {
        &self.period
    }

    /// Whether the joints are controlled, or looked at, when they have to be.
    pub fn is_in_time(&self, task: &mut Task) -> bool {
        self.duty.is_kept(task)
    }

    /// The task's counts.
    pub fn counters(&self, task: &mut Task) -> Counters {
        self.counters.read(task)
    }

    /// Its counts, in the order of [`Counters`].
    pub const fn counts(&self) -> &[Counter] {
        self.counters.all()
    }
}

/// How late the task may be before the watchdog is no longer fed: for a period of 1 ms, and for a look.
const LATE: Ticks = 5;
const LATE_LOOK: Ticks = 2 * WATCH;

/// Runs the task of `motors`. `news` is posted when a joint has changed its state by itself.
pub fn run<const N: usize>(
    task: &mut Task,
    motors: &'static Motors<N>,
    mut joints: Joints<N>,
    mut devices: impl JointMotors,
    news: &'static Semaphore,
) -> Never {
    loop {
        match joints.awaited() {
            Awaited::Order => {
                motors.duty.rest(task);
                motors.ordered.wait(task);
                joints.order_or_look(true, &mut Here { task, motors, devices: &mut devices });
            }
            Awaited::OrderOrLook => {
                motors.duty.promise(task, LATE_LOOK);
                let is_ordered = motors.ordered.wait_timeout(task, WATCH).is_ok();
                joints.order_or_look(is_ordered, &mut Here { task, motors, devices: &mut devices });
            }
            Awaited::FirstPeriod => {
                // A signal that the last period before rest has left behind would pass for this one.
                while motors.period.try_wait(task) {}
                motors.period.wait(task);
                joints.first_period(&mut Here { task, motors, devices: &mut devices });
            }
            Awaited::Measurement => {
                motors.period.wait(task);
                joints.measurement(&mut Here { task, motors, devices: &mut devices });
            }
            // A loop of its own, of which each turn is a period: so `time-bound` sees what a period takes.
            Awaited::Period => {
                while joints.awaited() == Awaited::Period {
                    motors.period.wait(task);
                    motors.duty.promise(task, LATE);
                    let mut is_ordered = false;
                    while motors.ordered.try_wait(task) {
                        is_ordered = true;
                    }
                    motors.control(task, &mut joints, is_ordered, &mut devices, news);
                }
            }
        }
    }
}

impl<const N: usize> Motors<N> {
    /// A period of the joints has begun, and its signal was taken. `is_ordered` says that signals of orders
    /// were taken too. `news` is posted when a joint has changed its state by itself.
    #[inline(always)] // a frame of its own would take stack
    pub fn control(
        &'static self,
        task: &mut Task,
        joints: &mut Joints<N>,
        is_ordered: bool,
        devices: &mut impl JointMotors,
        news: &'static Semaphore,
    ) {
        self.count(task);
        if joints.period(is_ordered, &mut Here { task, motors: self, devices }) {
            news.post(task);
        }
    }

    /// Counts a period, and those that have passed meanwhile.
    fn count(&'static self, task: &mut Task) {
        let Counters { periods, missed } = &self.counters;
        periods.count(task);
        while self.period.try_wait(task) {
            missed.count(task);
        }
    }
}

/// The surroundings of the joints, for the task that runs.
pub struct Here<'a, D, const N: usize> {
    pub task: &'a mut Task,
    pub motors: &'static Motors<N>,
    pub devices: &'a mut D,
}

impl<D: JointMotors, const N: usize> Surroundings for Here<'_, D, N> {
    #[inline(always)]
    fn begin(&mut self) {
        // The first three periods are to begin in time.
        self.motors.duty.promise(self.task, LATE);
        self.devices.begin(self.task, &self.motors.period);
    }

    #[inline(always)]
    fn end(&mut self) {
        self.devices.end(self.task);
    }

    #[inline(always)]
    fn look(&mut self) {
        self.devices.look(self.task);
    }

    #[inline(always)]
    fn reading(&mut self, joint: usize) -> Reading {
        self.devices.reading(self.task, joint)
    }

    #[inline(always)]
    fn drive(&mut self, joint: usize, drive: i16) {
        self.devices.drive(self.task, joint, drive);
    }

    #[inline(always)]
    fn done(&mut self) {
        self.devices.done();
    }

    #[inline(always)]
    fn take_order(&mut self, joint: usize) -> Option<Order> {
        let panel = self.motors.panels.get(joint)?;
        self.task.mask(|masked| panel.take(masked))
    }

    #[inline(always)]
    fn show_position(&mut self, joint: usize, position: Option<Position>) {
        let Some(panel) = self.motors.panels.get(joint) else { return };
        self.task.mask(|masked| panel.position.set(masked, position));
    }

    #[inline(always)]
    fn show_state(&mut self, joint: usize, state: State) {
        let Some(panel) = self.motors.panels.get(joint) else { return };
        self.task.mask(|masked| {
            // Else an order has come that the joint has not begun with.
            if panel.order.get(masked).is_none() {
                panel.state.set(masked, state);
            }
        });
    }
}
