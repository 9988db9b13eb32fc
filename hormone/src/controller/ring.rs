//! Rings: who leads, and what happens as one closes or opens.

use super::{Controller, NOTHING, Response};
use crate::election::Token;
use crate::gait::{Leader, Once};
use crate::hormone::Hormone;
use crate::module_type::ModuleType;
use crate::period::Period;
use crate::rule::BACK;

impl Controller {
    /// Sends the token of a round of the election, if one begins at `now`. A leader whose tokens did not come
    /// back stands down in it, and rests.
    pub(super) fn round(&mut self, now: u16) -> Option<Response> {
        let has_led = self.election.ring().is_some();
        let token = self.election.round(now)?;
        let Response { send, .. } = self.send(Hormone::Token(token), BACK);
        let stands_down = has_led && self.election.ring().is_none();
        Some(Response { send, ..if stands_down { self.rest() } else { NOTHING } })
    }

    /// Passes a token on. `has_led` says that this module led before it came.
    #[inline(never)] // else its response takes stack beneath that of `reshaped`
    fn pass_on(&mut self, token: Token, has_led: bool) -> Response {
        let mut response = self.send(Hormone::Token(token), BACK);
        if has_led && !self.is_leader() {
            // No beat of the other module may come. The motion would begin again when the clock wraps.
            response.action = self.rest().action;
        }
        response
    }

    #[inline(never)] // keeps its stack frame out of the caller's
    pub(super) fn hear_token(&mut self, token: Token, now: u16) -> Response {
        let has_led = self.is_leader();
        let is_own = self.election.is_own(token);
        let passed_on = self.election.hear(token, now);
        if let Some(token) = passed_on {
            return self.pass_on(token, has_led);
        }
        if is_own && self.once().is_some() && self.reshaped_at.is_none() {
            // The chain has closed.
            return self.reshaped(now);
        }
        if self.is_leader() && !has_led {
            // For the same reasons as in `become_type` and in `topology`.
            self.pacemaker.skip(now);
            self.pacemaker.forget();
            self.source = None;
        }
        NOTHING
    }

    /// Whether this module may be part of a ring, judged by its type and its gait: a gait of rings, or one
    /// that ends in a ring.
    pub(super) fn is_in_ring(&self) -> bool {
        self.acting == ModuleType::Spine && (self.gait().leader == Leader::Elected || self.once().is_some())
    }

    /// What the robot does once it has taken the shape in which this module has its present type. A robot
    /// that was ordered to stop does nothing.
    pub(super) fn once(&self) -> Option<Once> {
        self.gait().once.filter(|once| once.becomes == self.acting && !self.is_halted())
    }

    /// The robot has taken another shape.
    pub(super) fn reshaped(&mut self, now: u16) -> Response {
        match self.once() {
            Some(once) => self.walk_from_now(once.then as u8, Period::OWN, now),
            None => NOTHING,
        }
    }
}
