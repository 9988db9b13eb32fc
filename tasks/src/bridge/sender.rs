//! The way of a packet to the other MCU: it is repeated where the bus fails, and given up where the other MCU
//! refuses it too often.
//!
//! The caller, which has the bus and a clock, drives it. While it is [idle](Sender::is_idle), the caller
//! gives the next packet to the bus and calls [`begin`](Sender::begin). The caller [polls](Sender::poll) with
//! each outcome, and after [`poll_in`](Sender::poll_in), and does what the [`Step`] says.

use kernel::Ticks;

use crate::device::Transfer;

/// How often a packet that the other MCU refuses is tried again. One that meets a bus that is stuck is tried
/// until the bus is free: what is said once, such as a joint's order, must not be lost by that.
pub const RETRY_LIMIT: u8 = 20;

/// The pause before each try, in ticks of 1 ms.
pub const PAUSE: Ticks = 1;

/// How long a transfer may take, in ticks of 1 ms. The longest takes 0.6 ms, and as much again if it waits
/// for one of the other MCU. The rest is for what else both MCUs have to do.
pub const TRANSFER_AT_MOST: Ticks = 5;

/// The next step: what is to be done, or counted.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[must_use]
pub enum Step {
    Nothing,
    /// The packet has arrived.
    Arrived,
    /// It failed, and is sent again after a pause.
    Failed,
    /// It was refused too often: it is lost.
    GaveUp,
    /// The pause is over: send the same packet again.
    SendAgain,
    /// The transfer takes too long: free the bus, then poll with the outcome if there is one after all, else
    /// with a [`Transfer::Fault`].
    Free,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing is to be sent.
    Idle,
    /// A packet is on the bus, or waits for it.
    OnBus,
    /// It failed, and is sent again after a while.
    Pausing,
}

/// One MCU's packet under way to the other.
pub struct Sender {
    phase: Phase,
    retries_left: u8,
    /// When the packet has taken too long, or is sent again.
    deadline: Ticks,
}

impl Default for Sender {
    fn default() -> Self {
        Self::new()
    }
}

impl Sender {
    /// Nothing is under way.
    pub const fn new() -> Self {
        Sender { phase: Phase::Idle, retries_left: 0, deadline: 0 }
    }

    /// Whether the next packet may begin.
    pub fn is_idle(&self) -> bool {
        self.phase == Phase::Idle
    }

    /// Whether a packet is on the bus, or waits for it.
    pub fn is_on_bus(&self) -> bool {
        self.phase == Phase::OnBus
    }

    /// A new packet was given to the bus at `now`.
    pub fn begin(&mut self, now: Ticks) {
        self.retries_left = RETRY_LIMIT;
        self.enter(Phase::OnBus, now.wrapping_add(TRANSFER_AT_MOST));
    }

    /// The step that follows from an outcome of the bus, or from the time if there is none.
    pub fn poll(&mut self, now: Ticks, outcome: Option<Transfer>) -> Step {
        match outcome {
            Some(Transfer::Done) => {
                self.phase = Phase::Idle;
                Step::Arrived
            }
            Some(failure) => match self.retries_left.checked_sub((failure == Transfer::Refused).into()) {
                Some(left) => {
                    self.retries_left = left;
                    self.enter(Phase::Pausing, now.wrapping_add(PAUSE));
                    Step::Failed
                }
                None => {
                    self.phase = Phase::Idle;
                    Step::GaveUp
                }
            },
            None if self.is_idle() || !self.is_due(now) => Step::Nothing,
            None if self.is_on_bus() => Step::Free,
            None => {
                self.enter(Phase::OnBus, now.wrapping_add(TRANSFER_AT_MOST));
                Step::SendAgain
            }
        }
    }

    /// How many ticks after `now` to poll if no outcome comes, at least one; `None` if never.
    pub fn poll_in(&self, now: Ticks) -> Option<Ticks> {
        (!self.is_idle()).then(|| self.deadline.wrapping_sub(now).clamp(1, TRANSFER_AT_MOST))
    }

    fn enter(&mut self, phase: Phase, deadline: Ticks) {
        self.phase = phase;
        self.deadline = deadline;
    }

    fn is_due(&self, now: Ticks) -> bool {
        // Modulo the clock's range, a deadline that has passed lies far ahead.
        self.deadline.wrapping_sub(now).wrapping_sub(1) >= TRANSFER_AT_MOST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DONE: Option<Transfer> = Some(Transfer::Done);
    const REFUSED: Option<Transfer> = Some(Transfer::Refused);
    const FAULT: Option<Transfer> = Some(Transfer::Fault);

    /// A packet begun at the end of the clock's range, and when.
    fn begun() -> (Sender, Ticks) {
        let (mut sender, now) = (Sender::new(), 65_533);
        assert!(sender.is_idle() && sender.poll_in(now).is_none());
        sender.begin(now);
        (sender, now)
    }

    #[test]
    fn a_packet_that_arrives_makes_way() {
        let (mut sender, now) = begun();
        assert!(!sender.is_idle());
        assert_eq!(sender.poll(now, None), Step::Nothing);
        assert_eq!(sender.poll(now, DONE), Step::Arrived);
        assert!(sender.is_idle());
        assert_eq!(sender.poll(now.wrapping_add(100), None), Step::Nothing);
    }

    #[test]
    fn one_that_is_refused_is_sent_again_after_a_pause_and_given_up_in_the_end() {
        let (mut sender, mut now) = begun();
        // While the bus is stuck no try counts.
        for failure in [FAULT, REFUSED] {
            for _ in 0..RETRY_LIMIT {
                assert_eq!(sender.poll(now, failure), Step::Failed);
                assert!(!sender.is_idle() && !sender.is_on_bus());
                assert_eq!(sender.poll(now, None), Step::Nothing, "not before the pause is over");
                assert_eq!(sender.poll_in(now), Some(PAUSE));
                now = now.wrapping_add(PAUSE);
                assert_eq!(sender.poll(now, None), Step::SendAgain);
                assert!(sender.is_on_bus());
            }
        }
        assert_eq!(sender.poll(now, FAULT), Step::Failed);
        assert_eq!(sender.poll(now, REFUSED), Step::GaveUp);
        assert!(sender.is_idle());
    }

    #[test]
    fn the_limit_counts_for_each_packet_anew() {
        let (mut sender, mut now) = begun();
        for _ in 0..3 {
            for _ in 0..RETRY_LIMIT {
                assert_eq!(sender.poll(now, REFUSED), Step::Failed);
                now = now.wrapping_add(PAUSE);
                assert_eq!(sender.poll(now, None), Step::SendAgain);
            }
            assert_eq!(sender.poll(now, DONE), Step::Arrived);
            sender.begin(now);
        }
    }

    #[test]
    fn a_bus_that_says_nothing_is_freed_and_the_packet_sent_again() {
        let (mut sender, begun) = begun();
        for elapsed in 0..TRANSFER_AT_MOST {
            let now = begun.wrapping_add(elapsed);
            assert_eq!(sender.poll(now, None), Step::Nothing);
            assert_eq!(sender.poll_in(now), Some(TRANSFER_AT_MOST - elapsed));
        }
        // However late it is looked at.
        for late in [0, 1, 1_000] {
            assert_eq!(sender.poll(begun.wrapping_add(TRANSFER_AT_MOST + late), None), Step::Free);
        }
        let now = begun.wrapping_add(TRANSFER_AT_MOST);
        assert_eq!(
            sender.poll_in(now.wrapping_add(1)),
            Some(TRANSFER_AT_MOST),
            "no sooner than it makes sense"
        );
        assert_eq!(sender.poll(now, FAULT), Step::Failed);
        assert_eq!(sender.poll(now.wrapping_add(PAUSE), None), Step::SendAgain);
    }
}
