//! The joints' task (paper, section 5): one on each MCU, the highest of all, woken each millisecond while a
//! joint moves.

use kernel::{Context, Masked, MaskedCell, Never, Semaphore, Task, Ticks};

use super::joint::{Joint, State};
use super::{Position, to_angle};
use crate::counter::{self, Counter};
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
    /// Of their task.
    duty: Duty,
}

/// What the joints' task counts. Both wrap.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Counters<Count = u16> {
    /// Periods in which the joints were controlled.
    pub periods: Count,
    /// Periods that passed before the one before was done.
    pub missed: Count,
}

/// What a joint is told.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Order {
    /// As [`Joint::turn_to`].
    Turn { angle: i16, speed: u8 },
    /// As [`Joint::release`].
    Relax,
}

/// Where a joint gets its orders, and shows what comes of them.
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
            counters: Counters { periods: Counter::new(), missed: Counter::new() },
            panels: [const { Panel::new() }; N],
            ordered: Semaphore::new(0),
            period: Semaphore::new(0),
            duty: Duty::new(),
        }
    }

    /// Gives an order to the joint with this index. It replaces one that the joint has not begun with.
    pub fn order(&self, task: &mut Task, index: usize, order: Order) {
        let Some(panel) = self.panels.get(index) else { return };
        let state = if order == Order::Relax { State::Off } else { State::Moving };
        task.mask(|masked| {
            panel.order.set(masked, Some(order));
            panel.state.set(masked, state);
        });
        self.ordered.post(task);
    }

    /// What the joint with this index is doing; `None` if there is no such joint here.
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

    /// What the task counts.
    pub fn counters(&self, task: &mut Task) -> Counters {
        let Counters { periods, missed } = &self.counters;
        Counters { periods: periods.get(task), missed: missed.get(task) }
    }

    /// Its counts, in the order of [`Counters`].
    pub const fn counts(&self) -> &[Counter] {
        // SAFETY: it is so.
        unsafe { counter::all(&self.counters) }
    }
}

/// How often joints at rest are looked at, in ticks of 1 ms.
pub const WATCH: Ticks = 32;

/// How late the task may be before the watchdog is no longer fed: of a period of 1 ms, and of a look.
const LATE: Ticks = 5;
const LATE_LOOK: Ticks = 2 * WATCH;

/// Runs the task of `motors`. `news` is posted when a joint has changed its state by itself.
///
/// Joints that are at rest need no computing: their drives stay as they are. They are looked at now and then,
/// and controlled again as soon as one is moved or told to.
pub fn run<const N: usize>(
    task: &mut Task,
    motors: &'static Motors<N>,
    mut joints: [Joint; N],
    mut devices: impl JointMotors,
    news: &'static Semaphore,
) -> Never {
    loop {
        rest(task, motors, &mut joints, &mut devices);
        motors.duty.promise(task, LATE);
        devices.begin(task, &motors.period);
        motors.period.wait(task); // until the joints have been measured once
        devices.done();
        let mut goes_on = true;
        while goes_on {
            motors.period.wait(task);
            motors.duty.promise(task, LATE);
            goes_on = motors.control(task, &mut joints, &mut devices, news);
        }
        devices.end(task);
    }
}

/// Waits until a joint has been moved or told to.
fn rest<const N: usize>(
    task: &mut Task,
    motors: &'static Motors<N>,
    joints: &mut [Joint; N],
    devices: &mut impl JointMotors,
) {
    while joints.iter().all(Joint::is_at_rest) {
        if !joints.iter().any(Joint::is_driven) {
            motors.duty.rest(task);
            return motors.ordered.wait(task);
        }
        motors.duty.promise(task, LATE_LOOK);
        devices.look(task);
        if motors.ordered.wait_timeout(task, WATCH).is_ok() {
            return;
        }
        for (index, joint) in joints.iter_mut().enumerate() {
            joint.watch(devices.reading(task, index));
        }
    }
}

impl<const N: usize> Motors<N> {
    /// One period, whose signal was taken: controls all joints. Returns whether one of them moves on. `news`
    /// is posted when one has changed its state by itself.
    #[inline(always)] // a frame of its own would take stack
    pub fn control(
        &'static self,
        task: &mut Task,
        joints: &mut [Joint; N],
        devices: &mut impl JointMotors,
        news: &'static Semaphore,
    ) -> bool {
        count(task, self);
        let mut goes_on = false;
        for (index, (joint, panel)) in joints.iter_mut().zip(&self.panels).enumerate() {
            if control(task, joint, panel, devices, index) {
                news.post(task);
            }
            goes_on |= !joint.is_at_rest();
        }
        devices.done();
        // Signals of orders that have been carried out, or will be in the next period.
        while goes_on && self.ordered.try_wait(task) {}
        goes_on
    }
}

/// Counts a period, and those that have passed meanwhile.
fn count<const N: usize>(task: &mut Task, motors: &'static Motors<N>) {
    let Counters { periods, missed } = &motors.counters;
    periods.count(task);
    while motors.period.try_wait(task) {
        missed.count(task);
    }
}

/// One period of a joint. Returns whether its state has changed by itself.
#[inline(always)]
fn control(
    task: &mut Task,
    joint: &mut Joint,
    panel: &Panel,
    devices: &mut impl JointMotors,
    index: usize,
) -> bool {
    match task.mask(|masked| panel.take(masked)) {
        Some(Order::Turn { angle, speed }) => joint.turn_to(angle, speed),
        Some(Order::Relax) => joint.release(),
        None => {}
    }
    let before = joint.state();
    let drive = joint.step(devices.reading(task, index));
    let (state, position) = (joint.state(), joint.position());
    // Each in a section of its own, for the sake of whoever else begins in time.
    task.mask(|masked| devices.drive(masked, index, drive));
    task.mask(|masked| {
        // Else an order has come that the joint has not begun with.
        if panel.order.get(masked).is_none() {
            panel.state.set(masked, state);
        }
    });
    task.mask(|masked| panel.position.set(masked, position));
    state != before
}
