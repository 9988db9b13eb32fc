//! The joints of one MCU: controlled each millisecond while one of them moves, looked at now and then while
//! all are at rest. A state machine; [a task](super::task) drives it.

use kernel::Ticks;

use super::Position;
use super::joint::{Joint, Reading, State};

/// How often joints at rest are looked at, in ticks of 1 ms.
pub const WATCH: Ticks = 32;

/// An order to a joint.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Order {
    /// As [`Joint::turn_to`].
    Turn { angle: i16, speed: u8 },
    /// As [`Joint::turn_by`].
    TurnBy { by: i16, speed: u8 },
    /// As [`Joint::release`].
    Relax,
}

impl Order {
    /// The state of a joint from this order on.
    pub const fn state(self) -> State {
        match self {
            Order::Turn { .. } | Order::TurnBy { .. } => State::Moving,
            Order::Relax => State::Off,
        }
    }
}

/// The motors of the joints, what is measured of them, and where their orders come from. Joints are named by
/// their indices.
pub trait Surroundings {
    /// Begins the periods: in each the joints are measured, and the drives put into effect.
    fn begin(&mut self);

    /// Ends the periods. The last drives are put into effect, and stay.
    fn end(&mut self);

    /// Has the joints measured once, within 2 ms.
    fn look(&mut self);

    /// The last measurement.
    fn reading(&mut self, joint: usize) -> Reading;

    /// Sets the drive from the next period on: -[`FULL_DRIVE`](super::FULL_DRIVE) to `FULL_DRIVE`.
    fn drive(&mut self, joint: usize, drive: i16);

    /// All is done for this period.
    fn done(&mut self);

    /// The order that this joint was given last, once.
    fn take_order(&mut self, joint: usize) -> Option<Order>;

    /// Shows where the joint is.
    fn show_position(&mut self, joint: usize, position: Option<Position>);

    /// Shows the state that the joint has entered by itself, unless an order has come meanwhile.
    fn show_state(&mut self, joint: usize, state: State);
}

/// What joints wait for.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Awaited {
    /// An order: nothing is driven.
    Order,
    /// An order, for [`WATCH`] ticks: what is driven is at rest.
    OrderOrLook,
    /// The first period, in which they are measured.
    FirstPeriod,
    /// The end of that period.
    Measurement,
    /// The next period.
    Period,
}

/// Joints, and what they wait for.
pub struct Joints<const N: usize> {
    joints: [Joint; N],
    awaited: Awaited,
}

impl<const N: usize> Joints<N> {
    /// Joints that are off.
    pub const fn new(joints: [Joint; N]) -> Self {
        const { assert!(N <= 2, "an MCU drives two joints at most") };
        Joints { joints, awaited: Awaited::Order }
    }

    /// What they wait for. When that has come, call the method of the same name.
    #[inline(always)]
    pub fn awaited(&self) -> Awaited {
        self.awaited
    }

    /// For joints at rest: an order has come if `is_ordered`; else it is time for a look.
    #[inline(always)] // a frame of its own would take stack
    pub fn order_or_look(&mut self, is_ordered: bool, around: &mut impl Surroundings) {
        if is_ordered {
            self.begin(around); // an order may count from where its joint is
        } else {
            for (index, joint) in self.joints.iter_mut().enumerate() {
                joint.watch(around.reading(index));
            }
            self.go_on(around);
        }
    }

    /// The first period has begun. The last measurement may be of long ago.
    #[inline(always)]
    pub fn first_period(&mut self, around: &mut impl Surroundings) {
        around.done();
        self.awaited = Awaited::Measurement;
    }

    /// The joints have been measured once.
    #[inline(always)]
    pub fn measurement(&mut self, around: &mut impl Surroundings) {
        for (index, joint) in self.joints.iter_mut().enumerate() {
            joint.resume(around.reading(index));
        }
        self.take_orders(around);
        around.done();
        self.awaited = Awaited::Period;
    }

    /// A period has begun, and an order has come since the last if `is_ordered`. Returns whether a joint has
    /// changed its state by itself.
    #[inline(always)]
    pub fn period(&mut self, is_ordered: bool, around: &mut impl Surroundings) -> bool {
        if is_ordered {
            self.take_orders(around);
        }
        // No loop: so each joint's addresses are constants.
        let is_news = self.control(0, around) | self.control(1, around);
        around.done();
        if self.are_at_rest() {
            around.end();
            self.go_on(around);
        }
        is_news
    }

    /// Controls a joint, if there is one with this index. Returns whether it has changed its state by itself.
    #[inline(always)]
    fn control(&mut self, index: usize, around: &mut impl Surroundings) -> bool {
        let Some(joint) = self.joints.get_mut(index) else { return false };
        let before = joint.state();
        let drive = joint.step(around.reading(index));
        around.drive(index, drive);
        around.show_position(index, joint.position());
        let is_news = joint.state() != before;
        if is_news {
            around.show_state(index, joint.state());
        }
        is_news
    }

    #[inline(never)] // seldom called, and from two places
    fn take_orders(&mut self, around: &mut impl Surroundings) {
        for (index, joint) in self.joints.iter_mut().enumerate() {
            match around.take_order(index) {
                Some(Order::Turn { angle, speed }) => joint.turn_to(angle, speed),
                Some(Order::TurnBy { by, speed }) => {
                    joint.turn_by(by, speed);
                    around.show_state(index, joint.state());
                }
                Some(Order::Relax) => joint.release(),
                None => {}
            }
        }
    }

    #[inline(always)]
    fn are_at_rest(&self) -> bool {
        let rests = |index: usize| self.joints.get(index).is_none_or(Joint::is_at_rest);
        rests(0) && rests(1)
    }

    /// Rests as long as all joints do: their drives stay as they are, and need no computing.
    fn go_on(&mut self, around: &mut impl Surroundings) {
        if !self.are_at_rest() {
            self.begin(around);
        } else if self.joints.iter().any(Joint::is_driven) {
            around.look();
            self.awaited = Awaited::OrderOrLook;
        } else {
            self.awaited = Awaited::Order;
        }
    }

    fn begin(&mut self, around: &mut impl Surroundings) {
        around.begin();
        self.awaited = Awaited::FirstPeriod;
    }
}
