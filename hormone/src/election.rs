//! How a ring of modules without IDs elects a leader, after Itai and Rodeh: by chance, for modules that are
//! all attached alike can't do it otherwise (Angluin).
//!
//! Who hears no leader's beat for two rounds becomes a candidate, draws a rank, and sends it round the ring.
//! A candidate that meets a higher rank follows, and passes it on; a lower one ends there. One's own rank
//! coming back has been everywhere: its candidate leads, and the hops are the ring's size. A leader goes on
//! with that, above all candidates, and draws its rank anew each time that it came back, so that a tie ends
//! in the next round. So two leaders, after a tie or where two chains closed to a ring, find out, and one of
//! them follows. Where frames are lost a token may take longer than a round: one of the rank before is still
//! the leader's own.
//!
//! A candidate that hears a beat waits for its token all the same: where a chain has just closed to a ring
//! the beat may be its own, of when it was the head. Where somebody leads, the token ends there.
//!
//! All that a token passes give way to it, so one whose candidate is gone must not go round for long: it ends
//! at the first module that it comes to again, where it has passed more than twice as many as before. One
//! that has passed some more is the next one, in a ring that has grown.
//!
//! Nobody knows how long a token takes round the ring before one came back. So a candidate keeps its rank
//! until then, and whoever has stood in vain waits twice as long for the next time, until a beat comes.

use tasks::lfsr;

use crate::time::{reached, until};

/// From one round to the next, in milliseconds, in a ring of up to 125 modules.
pub const ROUND: u16 = 1_000;

/// In a longer ring it is so long for each of its modules: twice what a token takes to the next one.
const HOP: u16 = 8;

/// The most modules that a token passes, and that a ring can have: as far as the leader's rounds can be
/// counted.
pub const LARGEST: u16 = 0xFFF;

/// The most rounds in which a follower waits for a sign of whoever leads or stands: longer than a token takes
/// round the largest ring.
const LONGEST_WAIT: u8 = 32;

/// A leader whose token does not come back in so many rounds is in no ring. At three frames of four lost, of
/// 20 modules' tokens two of five end on their way.
const PATIENCE: u8 = 16;

/// The bit of a rank that lifts leaders above candidates.
const LEADER: u16 = 0x8000;

/// What goes round the ring.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Token {
    /// Drawn by chance in bits 14..0; bit 15 is a leader's.
    pub rank: u16,
    /// The modules it has passed, up to [`LARGEST`].
    pub hops: u16,
}

impl Token {
    /// None that goes round is like this one, and has passed more modules.
    const NONE: Token = Token { rank: 0, hops: LARGEST };
}

#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
enum Role {
    Follower,
    Candidate,
    /// Of a ring of so many modules; rounds since its token came back.
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
    /// The rank before its own, of which tokens may still come back; 0 if there is none.
    rank_before: u16,
    /// A [shift register](lfsr).
    random: u16,
    round_at: u16,
    /// So many rounds it waits as a follower before it stands.
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

    /// A beat came: somebody leads, or this module did until it became a candidate.
    pub fn follow(&mut self, now: u16) {
        self.wait = 2;
        if self.role == Role::Candidate {
            self.wait_from(now);
        } else {
            self.give_way(now);
        }
    }

    /// Somebody stands.
    fn give_way(&mut self, now: u16) {
        self.role = Role::Follower;
        self.wait_from(now);
    }

    fn wait_from(&mut self, now: u16) {
        self.round_at = now.wrapping_add(u16::from(self.wait) * ROUND);
    }

    /// Nobody else leads: this module becomes a candidate at once.
    pub fn stand(&mut self, now: u16) {
        self.round_at = now;
    }

    /// The module is in no ring at `now`. A round that is due stays due, though the clock comes round.
    pub fn rest(&mut self, now: u16) {
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
                // It has been all round. If it is the ring that has grown so much, the next one passes.
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
        // The moment breaks the tie of two that began with one seed. Zero is the one state never left.
        self.random = lfsr::shifted::<16>((self.random ^ now).max(1));
        self.random & !LEADER
    }
}

#[cfg(test)]
mod tests;
