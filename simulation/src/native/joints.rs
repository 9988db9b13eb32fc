//! The joints of an MCU in a world: controlled each millisecond, as their task does it
//! ([`tasks::motor::task`]).

use tasks::message::TaskCode;
use tasks::motor::joint::{Joint, State};
use tasks::motor::task::{Order, WATCH};
use tasks::motor::{Axis, FULL_DRIVE, to_angle};
use tasks::request::Report;
use tasks::superbot::{JOINT, ROLL};

use crate::body::Body;

pub struct Joints {
    joints: Vec<Controlled>,
    /// Milliseconds until joints that are all at rest are looked at; `None` while they are controlled.
    look_in: Option<u16>,
}

struct Controlled {
    axis: Axis,
    joint: Joint,
    order: Option<Order>,
    /// As others see it, and what they were told last.
    state: State,
    told: State,
    /// The drive from the next millisecond on.
    drive: i16,
}

impl Joints {
    /// Joints that are off. That they are will be told, as after a reset.
    pub fn new(axes: &[Axis]) -> Self {
        let joint = |&axis: &Axis| Controlled {
            axis,
            joint: Joint::new(if axis == Axis::Roll { ROLL } else { JOINT }),
            order: None,
            state: State::Off,
            told: State::Moving,
            drive: 0,
        };
        Joints { joints: axes.iter().map(joint).collect(), look_in: Some(WATCH) }
    }

    /// Gives an order to the joint `axis`.
    pub fn order(&mut self, axis: Axis, order: Order) {
        let Some(joint) = self.joints.iter_mut().find(|joint| joint.axis == axis) else { return };
        joint.order = Some(order);
        joint.state = if order == Order::Relax { State::Off } else { State::Moving };
        if order != Order::Relax {
            joint.told = State::Moving;
        }
    }

    /// The joint that turns the docks of this MCU.
    pub fn first(&self) -> Axis {
        self.joints[0].axis
    }

    /// What that is doing.
    pub fn state(&self) -> State {
        self.joints[0].state
    }

    /// Where it is, in 0.1 degree, as far as that is known.
    pub fn angle(&self) -> Option<i16> {
        self.joints[0].joint.position().map(to_angle)
    }

    /// One millisecond. Sets the duties with which motors are driven in it; what is computed now takes effect
    /// in the next.
    pub fn step(&mut self, body: &Body, duties: &mut [f64; 3]) {
        for joint in &self.joints {
            duties[usize::from(joint.axis.index())] = f64::from(joint.drive) / f64::from(FULL_DRIVE);
        }
        if self.rests(body) {
            return;
        }
        self.joints.iter_mut().for_each(|joint| joint.control(body));
        self.look_in = self.joints.iter().all(|joint| joint.joint.is_at_rest()).then_some(WATCH);
    }

    /// Whether all joints stay at rest, which are looked at now and then.
    fn rests(&mut self, body: &Body) -> bool {
        let Some(left) = self.look_in.as_mut().filter(|_| self.joints.iter().all(|it| it.order.is_none()))
        else {
            return false;
        };
        *left -= 1;
        if *left == 0 {
            *left = WATCH;
            let driven = self.joints.iter_mut().filter(|joint| joint.joint.is_driven());
            driven.for_each(|joint| joint.joint.watch(body.reading(joint.axis)));
        }
        self.joints.iter().all(|joint| joint.joint.is_at_rest())
    }

    /// Tells of the joints that have changed their state by themselves; of the first one not if a search
    /// turns it.
    pub fn tell(&mut self, is_searching: bool, reports: &mut Vec<(TaskCode, Report)>) {
        for (index, joint) in self.joints.iter_mut().enumerate() {
            let is_news = joint.state != joint.told && joint.state != State::Moving;
            joint.told = joint.state;
            if is_news && !(index == 0 && is_searching) {
                reports.push((TaskCode::joint(joint.axis), Report::Joint(joint.axis, joint.state)));
            }
        }
    }
}

impl Controlled {
    fn control(&mut self, body: &Body) {
        match self.order.take() {
            Some(Order::Turn { angle, speed }) => self.joint.turn_to(angle, speed),
            Some(Order::Relax) => self.joint.release(),
            None => {}
        }
        self.drive = self.joint.step(body.reading(self.axis));
        self.state = self.joint.state();
    }
}
