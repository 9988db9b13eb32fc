//! The hormone: a message without destination or ID, which acts through the rules of its receivers.
//!
//! Its name is in bits 7..4 of the first byte:
//!
//! | name | hormone | bytes |
//! |---|---|---|
//! | 1 to 11 | [`Pace`] of the named gait | name, made good and data, number and rhythm, in a ring lifetime |
//! | 12 | [`Standing`] order | name and gait, number (low byte, high byte), knows (7) and Period (6..0) |
//! | 13 | [`Order`] to walk by another gait | name and gait, serial, Period |
//! | 14 | [`Order`] to steer | name, held (3..2) and course (1..0), serial, lifetime |
//! | 15 | [`Token`] of an election | name and hops (11..8), rank (low byte, high byte), hops (7..0) |
//!
//! A [`Period`] is 5 to 80 times 50 ms, or 127 for the gait's own; an order may have 255 for that, too. Gait
//! 0 means stop.

use core::num::{NonZeroU8, NonZeroU16};

use tasks::message::Kind;

pub use crate::data::Data;
use crate::election::Token;
use crate::order::{Course, Order, Steer, What};
use crate::pace::{NUMBERS, Pace, RHYTHMS};
use crate::period::Period;
pub use crate::standing::Standing;

/// The most bytes of a hormone's payload.
pub const LONGEST: usize = 4;

const LAST_GAIT: u8 = 11;
/// The bit of a pace that was made good.
const MADE_GOOD: u8 = 1 << 3;
const STANDING: u8 = 12;
/// The bit of a standing order that says that the receiver is known to know it.
const KNOWS: u8 = 1 << 7;
const WALK: u8 = 13;
const STEER: u8 = 14;
/// The lowest bit of the field in which an order to steer says how long it has held.
const HELD: u8 = 2;
const ELECTION: u8 = 15;

/// A hormone message.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Hormone {
    /// A gait's beat.
    Pace(Pace),
    /// What a remote control wants the robot to do.
    Order(Order),
    /// The sender's standing order, and whether the sender knows that the receiver knows it.
    Standing(Standing, bool),
    /// A ring elects its leader.
    Token(Token),
}

/// A hormone as the bytes of a message.
pub type Payload = heapless::Vec<u8, LONGEST>;

impl Hormone {
    /// How links carry it: of beats that were not sent yet, only the last one matters.
    pub fn kind(self) -> Kind {
        match self {
            Hormone::Pace(_) => Kind::Latest,
            Hormone::Order(_) | Hormone::Standing(..) | Hormone::Token(_) => Kind::Lasting,
        }
    }

    /// The hormone as a message payload.
    pub fn to_payload(self) -> Payload {
        let (bytes, length) = match self {
            Hormone::Pace(Pace { name, data, is_made_good, number, rhythm, lifetime }) => {
                let [low, high] = lifetime.map_or(0, NonZeroU16::get).to_le_bytes();
                let length = if high != 0 {
                    4
                } else if lifetime.is_some() {
                    3
                } else {
                    2
                };
                let made_good = if is_made_good { MADE_GOOD } else { 0 };
                let second = (number % NUMBERS * RHYTHMS) | (rhythm % RHYTHMS);
                ([name << 4 | made_good | data as u8, second, low, high], length)
            }
            Hormone::Standing(Standing { number, gait, period }, knows) => {
                let [low, high] = number.to_le_bytes();
                let knows = if knows { KNOWS } else { 0 };
                ([STANDING << 4 | gait, low, high, knows | period.to_byte()], 4)
            }
            Hormone::Order(Order { what, serial }) => {
                let (first, last) = match what {
                    What::Walk(gait, period) => (WALK << 4 | gait, period.to_byte()),
                    What::Steer(Steer { course, lifetime, held }) => {
                        (STEER << 4 | (held << HELD) & 0x0F | course as u8, lifetime.get())
                    }
                };
                ([first, serial, last, 0], 3)
            }
            Hormone::Token(Token { rank, hops }) => {
                let ([low, high], [hops, more]) = (rank.to_le_bytes(), hops.to_le_bytes());
                ([ELECTION << 4 | more, low, high, hops], 4)
            }
        };
        let mut payload = Payload::from_array(bytes);
        payload.truncate(length);
        payload
    }

    /// The hormone in `payload`, or `None` if it is not exactly one of those in the table above.
    pub fn from_payload(payload: &[u8]) -> Option<Hormone> {
        let &[first, second, ref rest @ ..] = payload else { return None };
        let (name, low) = (first >> 4, first & 0x0F);
        Some(match name {
            1..=LAST_GAIT => {
                let lifetime = match *rest {
                    [] => None,
                    [low] => Some(NonZeroU16::new(low.into())?),
                    [low, high] if high != 0 => Some(NonZeroU16::new(u16::from_le_bytes([low, high]))?),
                    _ => return None,
                };
                let (data, is_made_good) = (Data::from_byte(low & !MADE_GOOD)?, low & MADE_GOOD != 0);
                let (number, rhythm) = (second / RHYTHMS, second % RHYTHMS);
                Hormone::Pace(Pace { name, data, is_made_good, number, rhythm, lifetime })
            }
            STANDING if low <= LAST_GAIT => {
                let &[high, last] = rest else { return None };
                let period = Period::from_byte(last & !KNOWS)?;
                let number = u16::from_le_bytes([second, high]);
                Hormone::Standing(Standing { number, gait: low, period }, last & KNOWS != 0)
            }
            WALK if low <= LAST_GAIT => {
                let &[period] = rest else { return None };
                let period = if period == u8::MAX { Period::OWN } else { Period::from_byte(period)? };
                Hormone::Order(Order { what: What::Walk(low, period), serial: second })
            }
            STEER => {
                let &[lifetime] = rest else { return None };
                let course = Course::from_byte(low & ((1 << HELD) - 1))?;
                let steer = Steer { course, lifetime: NonZeroU8::new(lifetime)?, held: low >> HELD };
                Hormone::Order(Order { what: What::Steer(steer), serial: second })
            }
            ELECTION => {
                let &[high, hops] = rest else { return None };
                let hops = u16::from_le_bytes([hops, low]);
                Hormone::Token(Token { rank: u16::from_le_bytes([second, high]), hops })
            }
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_the_documented_one() {
        let pace =
            Pace { name: 1, data: Data::B, is_made_good: false, number: 2, rhythm: 0x1A, lifetime: None };
        assert_eq!(Hormone::Pace(pace).to_payload().as_slice(), [0x11, 0x5A]);
        let made_good = Pace { is_made_good: true, ..pace };
        assert_eq!(Hormone::Pace(made_good).to_payload().as_slice(), [0x19, 0x5A]);
        let limited = Pace { lifetime: NonZeroU16::new(6), ..pace };
        assert_eq!(Hormone::Pace(limited).to_payload().as_slice(), [0x11, 0x5A, 6]);
        let limited = Pace { lifetime: NonZeroU16::new(0x106), ..pace };
        assert_eq!(Hormone::Pace(limited).to_payload().as_slice(), [0x11, 0x5A, 6, 1]);
        let order = Order { what: What::Walk(2, Period::OWN), serial: 3 };
        assert_eq!(Hormone::Order(order).to_payload().as_slice(), [0xD2, 3, 127]);
        assert_eq!(Hormone::from_payload(&[0xD2, 3, 255]), Some(Hormone::Order(order)));
        let standing = Standing { number: 0x0102, gait: 9, period: Period::from_byte(80).unwrap() };
        assert_eq!(Hormone::Standing(standing, false).to_payload().as_slice(), [0xC9, 2, 1, 80]);
        assert_eq!(Hormone::Standing(standing, true).to_payload().as_slice(), [0xC9, 2, 1, 0xD0]);
        let steer = Steer { course: Course::Right, lifetime: NonZeroU8::MAX, held: 0 };
        let order = Order { what: What::Steer(steer), ..order };
        assert_eq!(Hormone::Order(order).to_payload().as_slice(), [0xE2, 3, 255]);
        let order = Order { what: What::Steer(Steer { held: 3, ..steer }), ..order };
        assert_eq!(Hormone::Order(order).to_payload().as_slice(), [0xEE, 3, 255]);
        assert_eq!(
            Hormone::Token(Token { rank: 0x8102, hops: 7 }).to_payload().as_slice(),
            [0xF0, 2, 0x81, 7]
        );
        let far = Hormone::Token(Token { rank: 0x8102, hops: 0xF07 });
        assert_eq!(far.to_payload().as_slice(), [0xFF, 2, 0x81, 7]);
    }

    #[test]
    fn every_hormone_survives_its_payload_and_nothing_else_is_one() {
        for first in 0..=u8::MAX {
            let (name, low) = (first >> 4, first & 0x0F);
            let is_pace = (1..=11).contains(&name) && low & 7 < 6;
            let is_walk = name == 13 && low < 12;
            let is_steer = name == 14 && low & 3 < 3;
            let is_standing = name == 12 && low < 12;
            let is_token = name == 15;
            for second in [0, 1, 0x80, 0xFF] {
                let payloads: [(&[u8], bool); 12] = [
                    (&[], false),
                    (&[first], false),
                    (&[first, second], is_pace),
                    (&[first, second, 0], false),
                    (&[first, second, 4], is_pace || is_steer),
                    (&[first, second, 80], is_pace || is_steer || is_walk),
                    (&[first, second, 127], is_pace || is_steer || is_walk),
                    (&[first, second, 9, 0], is_token),
                    (&[first, second, 9, 5], is_token || is_pace || is_standing),
                    (&[first, second, 9, 0x7F], is_token || is_pace || is_standing),
                    (&[first, second, 9, 0xFF], is_token || is_pace || is_standing),
                    (&[first, second, 9, 1, 0], false),
                ];
                for (payload, is_one) in payloads {
                    let hormone = Hormone::from_payload(payload);
                    assert_eq!(hormone.is_some(), is_one, "{payload:?}");
                    assert!(hormone.is_none_or(|hormone| hormone.to_payload().as_slice() == payload));
                }
            }
        }
    }
}
