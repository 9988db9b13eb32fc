//! How one dock finds another: the joint behind it turns to where infrared is reflected most.

/// The first turn, in 0.1 degree. It becomes half with each turn in vain.
const FIRST_TURN: i16 = 32;

/// A turn smaller than this, in 0.1 degree, does not help a latch.
const SMALLEST_TURN: i16 = 4;

/// A turn has helped if it gives this much more, in counts of the converter.
const GAIN: u16 = 3;

/// The most turns: they take a joint well over 20 degrees from where it began.
const MOST_TURNS: u8 = 40;

/// What to do next.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Next {
    /// Turn the joint to this angle, in 0.1 degree, and look again.
    Turn(i16),
    /// The docks face each other: latch.
    Latch,
    /// No dock is within reach. The joint should go back to where it was.
    Lost,
}

/// One search.
#[derive(Clone, Copy)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Guidance {
    /// How much is reflected where the docks face each other close enough to latch.
    near: u16,
    angle: i16,
    best_angle: i16,
    best: u16,
    turn: i16,
    turns_left: u8,
}

impl Guidance {
    /// A search that begins at `angle`, in 0.1 degree. It ends with [`Next::Latch`] where at least `near`
    /// counts are reflected.
    pub const fn new(angle: i16, near: u16) -> Self {
        Guidance { near, angle, best_angle: angle, best: 0, turn: FIRST_TURN, turns_left: MOST_TURNS }
    }

    /// What to do after `reflected` counts were read where the last turn led, or at the start.
    pub fn step(&mut self, reflected: u16) -> Next {
        let is_first = self.turns_left == MOST_TURNS;
        if is_first || reflected >= self.best.saturating_add(GAIN) {
            self.best = reflected;
            self.best_angle = self.angle;
        } else {
            // Back, and half as far.
            self.turn = -(self.turn / 2);
        }
        self.turns_left = self.turns_left.saturating_sub(1);
        if self.turn.abs() >= SMALLEST_TURN && self.turns_left != 0 {
            self.angle = self.best_angle.saturating_add(self.turn);
            Next::Turn(self.angle)
        } else if self.angle != self.best_angle {
            self.angle = self.best_angle;
            Next::Turn(self.angle)
        } else if reflected >= self.near {
            Next::Latch
        } else {
            Next::Lost
        }
    }
}
