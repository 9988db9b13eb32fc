//! Orders of a remote control to the robot: to walk by a gait, to stop, or to turn.
//!
//! The remote control is any sender of orders: a behaviour of any module, or a device at a free dock. An
//! order to walk becomes the [standing order](crate::standing) of the robot. A course goes to every module by
//! every dock, and the remote control repeats it; when the remote control falls silent, the robot goes
//! straight ahead. A newer course supersedes an older one, so a course that comes back round a loop ends. A
//! neighbour that is told the standing order, such as one that starts, is told the course as well, and for
//! how long it has held: so it holds there no longer than here.

use core::num::NonZeroU8;

use tasks::dock::DockSet;

use crate::period::Period;
use crate::time::{reached, until};

/// How long a course holds after it was last ordered, in milliseconds.
pub const HOLDS: u16 = 2_000;

/// An order says in steps of so many milliseconds how long its course has held: 0 to 3 steps.
const STEP: u16 = 512;
const MOST_STEPS: u16 = 3;

/// Where the robot is to go.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(u8)]
pub enum Course {
    /// Straight ahead.
    Ahead = 0,
    /// Turn left: legs on the left step backward, half as far as those on the right ahead.
    Left = 1,
    /// Turn right: legs on the right step backward, half as far as those on the left ahead.
    Right = 2,
}

impl Course {
    /// The course with code `byte`.
    pub const fn from_byte(byte: u8) -> Option<Course> {
        match byte {
            0 => Some(Course::Ahead),
            1 => Some(Course::Left),
            2 => Some(Course::Right),
            _ => None,
        }
    }
}

/// What is ordered.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum What {
    /// Walk by the gait with this [name](crate::gait::Gait::name) in this Period, or
    /// [stop](crate::standing::STOP).
    Walk(u8, Period),
    /// Turn.
    Steer(Steer),
}

/// A course on its way.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Steer {
    /// Where the robot is to go.
    pub course: Course,
    /// The modules that it may still reach.
    pub lifetime: NonZeroU8,
    /// For how many steps of 512 ms it has held, 0 to 3; a step that has begun counts.
    pub held: u8,
}

/// An order on its way.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Order {
    /// What is ordered.
    pub what: What,
    /// Counts the orders of one remote control, modulo 256. Modules tell a newer course from an older one by
    /// it, because courses go round loops. It does not matter for an order to walk, which modules tell each
    /// other as the [standing order](crate::standing).
    pub serial: u8,
}

/// A module's memory of courses.
pub struct Helm {
    course: Course,
    serial: u8,
    /// The modules behind this one that the course may still reach.
    lifetime: u8,
    /// Until when the course holds, if one does.
    until: Option<u16>,
    /// These neighbours may not know the course.
    untold: DockSet,
}

impl Helm {
    /// A module that has heard of no course.
    #[expect(clippy::new_without_default, reason = "the state at power-up, not a value to fall back on")]
    pub const fn new() -> Self {
        Helm { course: Course::Ahead, serial: 0, lifetime: 0, until: None, untold: DockSet::EMPTY }
    }

    /// Takes in an order with this serial to hold a course. Returns whether it is news: newer than the last,
    /// or the first for [`HOLDS`].
    pub fn hear(&mut self, steer: Steer, serial: u8, now: u16) -> bool {
        self.expire(now);
        let is_newer = (1..0x80).contains(&serial.wrapping_sub(self.serial));
        if self.until.is_some() && !is_newer {
            return false;
        }
        self.course = steer.course;
        self.serial = serial;
        self.lifetime = steer.lifetime.get() - 1;
        self.until = Some(now.wrapping_add(HOLDS - u16::from(steer.held & 3) * STEP));
        true
    }

    /// The order that goes on to other modules at `now`; `None` where it may reach none, or is nearly over.
    pub fn onward(&self, now: u16) -> Option<Order> {
        let lifetime = NonZeroU8::new(self.lifetime)?;
        let held = (HOLDS - until(self.until?, now)).div_ceil(STEP);
        let what = What::Steer(Steer { course: self.course, lifetime, held: held as u8 });
        (held <= MOST_STEPS).then_some(Order { what, serial: self.serial })
    }

    /// Forgets a course that no longer holds. Call at least every 30 s while one holds.
    pub fn expire(&mut self, now: u16) {
        if self.until.is_some_and(|at| reached(at, now)) {
            *self = Helm::new();
        }
    }

    /// Milliseconds from `now` until [`expire`](Self::expire) is to be called, if it is.
    pub fn next_due(&self, now: u16) -> Option<u16> {
        self.until.map(|at| until(at, now))
    }

    /// These neighbours may not know the course.
    pub fn tell(&mut self, docks: DockSet) {
        if self.course != Course::Ahead {
            self.untold = self.untold.union(docks);
        }
    }

    /// The order to pass on at `now`, to neighbours that may not know it.
    pub fn due(&mut self, now: u16) -> Option<(Order, DockSet)> {
        let docks = core::mem::take(&mut self.untold);
        if docks.is_empty() {
            return None;
        }
        Some((self.onward(now)?, docks))
    }

    /// The course to hold.
    pub fn course(&self) -> Course {
        self.course
    }
}

#[cfg(test)]
mod tests {
    use tasks::dock::Dock;

    use super::*;

    const LEFT: Steer = Steer { course: Course::Left, lifetime: NonZeroU8::new(3).unwrap(), held: 0 };
    const RIGHT: Steer = Steer { course: Course::Right, ..LEFT };

    #[test]
    fn a_newer_order_supersedes_an_older_one_also_when_serials_wrap() {
        let mut helm = Helm::new();
        assert!(helm.hear(LEFT, 255, 0));
        assert!(helm.hear(RIGHT, 0, 10));
        assert!(!helm.hear(LEFT, 255, 20), "it came late");
        assert!(!helm.hear(RIGHT, 0, 30), "it came back");
        assert_eq!(helm.course(), Course::Right);
    }

    #[test]
    fn a_course_holds_until_the_remote_control_has_been_silent() {
        let mut helm = Helm::new();
        helm.hear(LEFT, 7, 65_000);
        assert_eq!(helm.next_due(65_000), Some(HOLDS));
        helm.expire(65_000_u16.wrapping_add(HOLDS - 1));
        assert_eq!(helm.course(), Course::Left);
        helm.expire(65_000_u16.wrapping_add(HOLDS));
        assert_eq!(helm.course(), Course::Ahead);
        assert!(helm.hear(LEFT, 7, 2_000), "another remote control begins as it likes");
    }

    #[test]
    fn where_it_is_told_it_holds_no_longer_and_reaches_no_further() {
        for heard_at in [0, 64_000] {
            for after in 0..=HOLDS {
                let (mut helm, mut other) = (Helm::new(), Helm::new());
                helm.hear(LEFT, 7, heard_at);
                let now = heard_at.wrapping_add(after);
                helm.expire(now);
                helm.tell(DockSet::of(&[Dock::Back]));
                let told = helm.due(now);
                assert_eq!(told.is_some(), after <= MOST_STEPS * STEP, "after {after} ms");
                let Some((Order { what: What::Steer(steer), serial }, _)) = told else { continue };
                assert_eq!((steer.course, steer.lifetime.get(), serial), (Course::Left, 2, 7));
                other.hear(steer, serial, now);
                let lefts = [&helm, &other].map(|helm| helm.next_due(now).expect("it holds"));
                assert!(lefts[1] <= lefts[0] && lefts[0] < lefts[1] + STEP, "{lefts:?} after {after} ms");
            }
        }
        let mut last = Helm::new();
        last.hear(Steer { lifetime: NonZeroU8::MIN, ..LEFT }, 7, 0);
        assert_eq!(last.onward(0), None);
    }
}
