//! How a ring of modules without IDs elects a leader, after Itai and Rodeh: by chance, because modules that
//! are all attached alike can't do it otherwise (Angluin).
//!
//! A module that hears no leader's beat for two rounds becomes a candidate, draws a rank, and sends it round
//! the ring in a token. A candidate that meets a higher rank follows, and passes the token on; a token of a
//! lower rank ends there. A token that comes back to its candidate has been everywhere: the candidate leads,
//! and the hops are the ring's size. A leader goes on sending tokens, with ranks above those of all
//! candidates, and draws a new rank each time a token has come back, so that a tie ends in the next round. So
//! two leaders, after a tie or where two chains closed to a ring, find each other out, and one of them
//! follows. Where frames are lost, a token may take longer than a round: a leader also knows a token of its
//! previous rank as its own.
//!
//! A candidate that hears a beat still waits for its token: where a chain has just closed to a ring, the beat
//! may be its own, from when it was the head. If another module leads, the token ends there.
//!
//! All modules that a token passes give way to it, so a token whose candidate is gone must not go round for
//! long. It ends at the first module that it comes to again, where it has passed more than twice as many
//! modules as before. A token that has passed only some more is the candidate's next one, in a ring that has
//! grown.
//!
//! No module knows how long a token takes round the ring before one has come back. So a candidate keeps its
//! rank until then, and a module that was a candidate in vain waits twice as long before the next time, until
//! a beat comes.

use tasks::lfsr;

use crate::time::{reached, until};

/// From one round to the next, in milliseconds, in a ring of up to 125 modules.
pub const ROUND: u16 = 1_000;

/// In a longer ring a round takes this long for each module, in milliseconds: twice what a token takes to the
/// next module.
const HOP: u16 = 8;

/// The most modules that a token passes, and that a ring can have: the clock can still time the leader's
/// round, which takes 8 ms for each.
pub const LARGEST: u16 = 0xFFF;

/// The most rounds for which a follower waits for a sign of a leader or a candidate: longer than a token
/// takes round the largest ring.
const LONGEST_WAIT: u8 = 32;

/// A leader whose token does not come back in so many rounds is in no ring. Where three frames of four are
/// lost, two of five tokens end on their way round 20 modules.
const PATIENCE: u8 = 16;

/// The bit of a rank that lifts leaders above candidates.
const LEADER: u16 = 0x8000;

/// The token that goes round the ring.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Token {
    /// Drawn by chance in bits 14..0; bit 15 is a leader's.
    pub rank: u16,
    /// The modules it has passed, up to [`LARGEST`].
    pub hops: u16,
}

impl Token {
    /// No token: one of the same rank that goes round has not passed more modules.
    const NONE: Token = Token { rank: 0, hops: LARGEST };
}

#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
enum Role {
    Follower,
    Candidate,
    /// The leader of a ring of so many modules; rounds since its token came back.
    Leader {
        ring: u16,
        silent: u8,
    },
}

/// A module's part in the election.
pub struct Election {
    role: Role,
    /// The token that it sent last, with no hop, or passed on, with the fewest hops that it came with.
    last: Token,
    /// The previous rank of this module, of which tokens may still come back; 0 if there is none.
    rank_before: u16,
    /// A [shift register](lfsr).
    random: u16,
    round_at: u16,
    /// The rounds for which it waits as a follower before it becomes a candidate.
    wait: u8,
}

impl Election {
    /// A follower at `now`. `seed` should differ from module to module.
    pub const fn new(seed: u16, now: u16) -> Self {
        let round_at = now.wrapping_add(2 * ROUND);
        Election { role: Role::Follower, last: Token::NONE, rank_before: 0, random: seed, round_at, wait: 2 }
    }

    /// The size of the ring that this module leads, if it does.
    pub fn ring(&self) -> Option<u16> {
        match self.role {
            Role::Leader { ring, .. } => Some(ring),
            _ => None,
        }
    }

    /// The module is in no ring.
    pub fn leave(&mut self, now: u16) {
        self.last = Token::NONE;
        self.wait = 2;
        self.give_way(now);
    }

    /// A beat came: another module leads, or this one did until it became a candidate.
    pub fn follow(&mut self, now: u16) {
        self.wait = 2;
        if self.role == Role::Candidate {
            self.wait_from(now);
        } else {
            self.give_way(now);
        }
    }

    /// Another module is a candidate or leads: this one follows.
    fn give_way(&mut self, now: u16) {
        self.role = Role::Follower;
        self.wait_from(now);
    }

    fn wait_from(&mut self, now: u16) {
        self.round_at = now.wrapping_add(u16::from(self.wait) * ROUND);
    }

    /// No other module leads: this one becomes a candidate at once.
    pub fn stand(&mut self, now: u16) {
        self.round_at = now;
    }

    /// The module is in no ring at `now`, and leads none any more. A round that is due stays due when the
    /// clock wraps.
    pub fn rest(&mut self, now: u16) {
        self.role = Role::Follower;
        if reached(self.round_at, now) {
            self.round_at = now;
        }
    }

    /// The token to send, if a round begins at `now`.
    pub fn round(&mut self, now: u16) -> Option<Token> {
        if !reached(self.round_at, now) {
            return None;
        }
        let mut next = ROUND;
        match self.role {
            Role::Candidate => {}
            Role::Leader { ring, silent } if silent < PATIENCE => {
                self.role = Role::Leader { ring, silent: silent + 1 };
                if silent == 0 {
                    self.rank_before = self.last.rank;
                    self.last.rank = self.draw(now) | LEADER;
                }
                next = next.max(ring * HOP);
            }
            _ => {
                self.rank_before = if self.role == Role::Follower { 0 } else { self.last.rank };
                self.role = Role::Candidate;
                self.last.rank = self.draw(now);
                self.wait = LONGEST_WAIT.min(2 * self.wait);
            }
        }
        self.last.hops = 0;
        self.round_at = now.wrapping_add(next);
        Some(Token { hops: 1, ..self.last })
    }

    /// Milliseconds from `now` until the next round.
    pub fn next_due(&self, now: u16) -> u16 {
        until(self.round_at, now)
    }

    /// Whether it is this module's own token, which has been all round.
    pub fn is_own(&self, token: Token) -> bool {
        self.role != Role::Follower && token.rank == self.last.rank
    }

    /// Takes in a token. Returns what goes on to the next module, if anything does.
    pub fn hear(&mut self, token: Token, now: u16) -> Option<Token> {
        if self.is_own(token) {
            self.role = Role::Leader { ring: token.hops, silent: 0 };
            return None;
        }
        let mut fewest = token.hops;
        if self.role != Role::Follower {
            if token.rank < self.last.rank || token.rank == self.rank_before {
                return None;
            }
        } else if token.rank == self.last.rank {
            if token.hops > 2 * self.last.hops {
                // It has been all round. If it is the ring that has grown so much, the next token passes.
                self.last = Token::NONE;
                return None;
            }
            fewest = fewest.min(self.last.hops);
        }
        self.last = Token { hops: fewest, ..token };
        self.give_way(now);
        (token.hops < LARGEST).then_some(Token { hops: token.hops + 1, ..token })
    }

    fn draw(&mut self, now: u16) -> u16 {
        // `now` breaks the tie of two modules with the same seed. The register would never leave state zero.
        self.random = lfsr::shifted::<16>((self.random ^ now).max(1));
        self.random & !LEADER
    }
}

#[cfg(test)]
mod tests;
