//! How one dock finds another: the joints of its module move it to where most of its light is reflected.
//!
//! A search follows two lines, one after the other. First the joint behind the dock turns it. Then that joint
//! and the other one, which bends the module the opposite way, shift it. On each line the search moves on for
//! as long as the reflection grows, tries the other side unless it grew on the first, and returns until the
//! reflection on the way back is greatest. Once the dock is near enough to latch, it stops as soon as the
//! reflection falls. An offset that one module can't correct, above all one along the line between the docks,
//! the module of the other dock can: both search in turn, and each begins where it has left off.

/// The reflection from which on the docks face each other close enough to latch, in counts of the converter.
const NEAR: u16 = 500;

/// The least reflection of a dock that the latch has hold of, in counts of the converter: the docks touch.
pub const HELD: u16 = 650;

/// Both joints move this far to either side of where a line begins, in 0.1 degree.
const REACH: i16 = 120;

/// The play of what the joints push along, in 0.1 degree: it yields by up to this much when they reverse. So
/// the place of the greatest reflection on the way there may be this far from that on the way back.
const SLACK: i16 = 30;

/// A reflection below this is not a dock's light, in counts of the converter.
const LEAST: u16 = 8;

/// A reflection has become less, not by noise alone, if it has lost more than a thirty-second part and this.
const LOSS: u16 = 4;

/// A line that joints follow.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Line {
    /// The joint behind the dock turns.
    Turn,
    /// That joint turns, and the other one that bends the module turns back as far: the dock moves aside.
    Shift,
}

/// The next thing to do.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Next {
    /// Go on as before, and look again.
    GoOn,
    /// Move along the line until the joint behind the dock is at this angle, in 0.1 degree, and look
    /// meanwhile.
    Move(Line, i16),
    /// The docks face each other: latch.
    Latch,
    /// The dock is not near enough to latch, and this module can do no more for that.
    Lost,
}

/// Where on its line a search is.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
enum Leg {
    Start,
    /// To larger angles.
    Up,
    /// To smaller ones.
    Down,
    /// Back to where the reflection on this way is greatest.
    Back,
    /// A stop where the joint is.
    Stop,
}

/// One search.
#[derive(Clone, Copy)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Guidance {
    line: Line,
    leg: Leg,
    /// Where the line began, in 0.1 degree, and the reflection there.
    start: i16,
    first: u16,
    best_angle: i16,
    best: u16,
    /// How often it has looked on this leg.
    looks: u8,
}

impl Default for Guidance {
    fn default() -> Self {
        Self::new()
    }
}

impl Guidance {
    /// A search that has not begun to move.
    pub const fn new() -> Self {
        Guidance { line: Line::Turn, leg: Leg::Start, start: 0, first: 0, best_angle: 0, best: 0, looks: 0 }
    }

    /// The line that it follows.
    pub fn line(&self) -> Line {
        self.line
    }

    /// What to do after `reflected` counts were read while the joint behind the dock was at `angle`, in 0.1
    /// degree. `is_there`: the joint is where the last move led, or comes no further.
    pub fn step(&mut self, angle: i16, reflected: u16, is_there: bool) -> Next {
        // A leg takes a second at most: something may hold a joint without an effort that shows.
        let is_there = is_there || self.looks == u8::MAX;
        let next = self.advance(angle, reflected, is_there);
        self.looks = if next == Next::GoOn { self.looks.saturating_add(1) } else { 0 };
        next
    }

    fn advance(&mut self, angle: i16, reflected: u16, is_there: bool) -> Next {
        if self.leg == Leg::Start {
            return self.begin(angle, reflected);
        }
        if self.leg == Leg::Stop {
            return if is_there { self.end(angle, reflected) } else { Next::GoOn };
        }
        if reflected > self.best {
            self.best = reflected;
            self.best_angle = angle;
        }
        let has_passed = match self.leg {
            // On the way down the joint first passes what it left behind on the way up.
            Leg::Down => angle < self.best_angle.saturating_sub(SLACK) && is_less(reflected, self.best),
            Leg::Back => self.best > self.first + LOSS && reflected + LOSS < self.best,
            _ => is_less(reflected, self.best),
        };
        // A dock that is near enough now need not be so on the way back.
        if reflected >= NEAR && reflected + LOSS < self.best {
            self.leg = Leg::Stop;
            return Next::Move(self.line, angle);
        }
        if !is_there && !has_passed {
            return Next::GoOn;
        }
        match self.leg {
            Leg::Back => {
                self.leg = Leg::Stop;
                Next::Move(self.line, angle)
            }
            Leg::Up if !is_less(self.first, self.best) => {
                self.leg = Leg::Down;
                Next::Move(self.line, self.start.saturating_sub(REACH))
            }
            leg => {
                let slack = if leg == Leg::Up { -SLACK } else { SLACK };
                let to = self.best_angle.saturating_add(slack);
                (self.leg, self.first, self.best) = (Leg::Back, reflected, reflected);
                Next::Move(self.line, to)
            }
        }
    }

    fn begin(&mut self, angle: i16, reflected: u16) -> Next {
        if reflected < LEAST {
            return Next::Lost;
        }
        (self.leg, self.start, self.first) = (Leg::Up, angle, reflected);
        (self.best_angle, self.best) = (angle, reflected);
        Next::Move(self.line, angle.saturating_add(REACH))
    }

    fn end(&mut self, angle: i16, reflected: u16) -> Next {
        if reflected >= NEAR {
            return Next::Latch;
        }
        match self.line {
            Line::Turn => {
                self.line = Line::Shift;
                self.begin(angle, reflected)
            }
            Line::Shift => Next::Lost,
        }
    }
}

/// Whether `reflected` is less than `most`, and not by noise alone.
fn is_less(reflected: u16, most: u16) -> bool {
    reflected.saturating_add(LOSS) < most - most / 32
}

#[cfg(test)]
mod tests {
    use super::*;
    use Line::{Shift, Turn};
    use Next::{GoOn, Latch, Lost, Move};

    /// Each list is a search: the angle, the reflection, whether the joint has arrived, and what comes next.
    #[test]
    fn what_a_search_does_by_what_it_sees() {
        let near: &[_] = &[
            (0, 400, true, Move(Turn, 120)),
            (10, 504, false, GoOn),
            (11, 499, false, GoOn), // less, and not near enough
            (12, 505, false, GoOn),
            (13, 501, false, GoOn), // near enough, but not yet less
            (14, 500, false, Move(Turn, 14)),
            (14, 500, false, GoOn),
            (14, 500, true, Latch),
        ];
        let both_lines: &[_] = &[
            (0, 100, true, Move(Turn, 120)),
            (45, 480, false, GoOn),
            (46, 461, false, GoOn), // less by noise alone
            (50, 496, false, GoOn),
            (51, 496, false, GoOn),
            (61, 476, false, Move(Turn, 50 - 30)),
            (48, 480, false, GoOn),
            (47, 475, false, GoOn), // it may be the noise that has grown
            (46, 481, false, GoOn),
            (45, 477, false, GoOn),
            (44, 476, false, Move(Turn, 44)),
            (44, 499, true, Move(Shift, 44 + 120)), // not near enough, so on with both joints
            (164, 504, true, Move(Shift, 44 - 120)), // no more but by noise: the other side may have more
            (40, 520, false, GoOn),
            (10, 480, false, GoOn), // within the play of what it drags along
            (9, 480, false, Move(Shift, 40 + 30)),
            (70, 490, true, Move(Shift, 70)),
            (70, 499, true, Lost),
        ];
        let away: &[_] =
            &[(0, 400, true, Move(Turn, 120)), (1, 384, false, GoOn), (2, 383, false, Move(Turn, -120))];
        let faint: &[_] = &[(0, 7, true, Lost), (0, 8, true, Move(Turn, 120))];
        for search in [near, both_lines, away, faint] {
            let mut guidance = Guidance::new();
            for (look, &(angle, reflected, is_there, next)) in search.iter().enumerate() {
                assert_eq!(guidance.step(angle, reflected, is_there), next, "look {look}, {angle}");
            }
        }
    }

    /// Something may hold the joint.
    #[test]
    fn a_leg_ends_after_256_looks() {
        let mut guidance = Guidance::new();
        assert_eq!(guidance.step(0, 100, true), Move(Turn, 120));
        for to in [-120, 30, 0] {
            for _ in 0..255 {
                assert_eq!(guidance.step(0, 100, false), GoOn);
            }
            assert_eq!(guidance.step(0, 100, false), Move(Turn, to));
        }
    }
}
