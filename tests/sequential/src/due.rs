//! The parts of the loop that are due, after a signal or at a time.

use kernel::{Context, LONGEST, Semaphore, Ticks, is_reached};

/// A set of parts of the loop that get turns, and of signals for such parts, a bit each.
#[derive(Clone, Copy)]
pub struct Parts(u16);

impl Parts {
    pub const NONE: Parts = Parts(0);
    /// The joints' control.
    pub const JOINTS: Parts = Parts(1 << 0);
    pub const BRIDGE: Parts = Parts(1 << 1);
    /// The sending halves of the docks, by their index.
    pub const SENDING0: Parts = Parts(1 << 2);
    pub const SENDING1: Parts = Parts(1 << 3);
    pub const SENDING2: Parts = Parts(1 << 4);
    pub const DEVICES: Parts = Parts(1 << 5);
    pub const NEIGHBOURS: Parts = Parts(1 << 6);
    pub const HORMONES: Parts = Parts(1 << 7);
    #[cfg(feature = "trial")]
    pub const TRIAL: Parts = Parts(1 << 8);
    /// The number of parts above, which have times.
    const TIMES: usize = if cfg!(feature = "trial") { 9 } else { 8 };
    /// Something has come in at a dock.
    pub const RECEIVED: Parts = Parts(1 << 9);
    /// A frame has left a dock.
    pub const SENT0: Parts = Parts(1 << 10);
    pub const SENT1: Parts = Parts(1 << 11);
    pub const SENT2: Parts = Parts(1 << 12);
    /// A joint was told to move.
    pub const ORDERED: Parts = Parts(1 << 13);
    /// A period of the joints' control has begun.
    pub const PERIOD: Parts = Parts(1 << 14);
    #[cfg(feature = "trial")]
    pub const EDGE: Parts = Parts(1 << 15);

    /// These, and `part` if its `signal` is posted. Takes the signal.
    #[inline(always)] // so that the addresses are known
    pub fn with(self, part: Parts, signal: &Semaphore, context: &mut impl Context) -> Parts {
        self.and_if(part, signal.try_wait(context))
    }

    /// These, and `part` if that `is_due`.
    #[inline(always)]
    pub fn and_if(self, part: Parts, is_due: bool) -> Parts {
        if is_due { self.and(part) } else { self }
    }

    /// These and the others.
    #[inline(always)]
    pub fn and(self, others: Parts) -> Parts {
        Parts(self.0 | others.0)
    }

    /// Whether there is one.
    #[inline(always)]
    pub fn is_any(self) -> bool {
        self.0 != 0
    }

    /// Whether one of `parts` is among these.
    #[inline(always)]
    pub fn has(self, parts: Parts) -> bool {
        self.0 & parts.0 != 0
    }
}

/// When parts get their turns even if nothing is posted.
pub struct Times {
    times: [Option<Ticks>; Parts::TIMES],
    /// No time in `times` is before this one.
    pub next: Ticks,
}

impl Times {
    /// Times at which all parts are due at `now`.
    pub const fn new(now: Ticks) -> Self {
        Times { times: [Some(now); Parts::TIMES], next: now }
    }

    /// Sets the time of the next turn of `part`.
    #[inline(always)]
    pub fn set(&mut self, part: Parts, at: Option<Ticks>) {
        if let Some(time) = self.times.get_mut(part.0.trailing_zeros() as usize) {
            *time = at;
        }
        if let Some(at) = at
            && is_reached(at, self.next)
        {
            self.next = at;
        }
    }

    /// The parts whose times are reached.
    #[inline(always)] // mostly none is
    pub fn reached(&mut self, now: Ticks) -> Parts {
        if is_reached(self.next, now) { self.look(now) } else { Parts::NONE }
    }

    #[inline(never)] // its registers are needed here alone
    fn look(&mut self, now: Ticks) -> Parts {
        let mut parts = 0;
        let mut bit = 1;
        let mut rest = LONGEST;
        for time in &self.times {
            if let Some(time) = *time {
                if is_reached(time, now) {
                    parts |= bit;
                } else {
                    rest = rest.min(time.wrapping_sub(now));
                }
            }
            bit <<= 1;
        }
        self.next = now.wrapping_add(if parts == 0 { rest } else { 0 });
        Parts(parts)
    }
}
