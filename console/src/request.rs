//! A terminal's requests to the console, and the pieces that it gets.
//!
//! ```text
//!   begin      topic, a letter
//!   next       0x06, number         the piece with this number has come
//!   piece      number, 0..=15 characters in ASCII; none ends the text
//! ```
//!
//! Numbers are 0x80 to 0xFF, and 0x80 again after that; a text's first piece is 0x80. A terminal that gets no
//! reply repeats its request: then the text begins anew, or the piece comes again.

use tasks::message::MAX_PAYLOAD;

/// The most characters of a piece.
pub const PIECE: usize = MAX_PAYLOAD - 1;

const NEXT: u8 = 0x06;

/// The subject of a text.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
#[repr(u8)]
pub enum Topic {
    /// All of the following.
    All = b'a',
    /// The tasks of both MCUs and their stacks.
    Tasks = b't',
    /// Why the MCUs started, and how much of the time they are awake.
    Cpu = b'c',
    /// The counts of links, bridge, joints' control and devices.
    Counts = b'l',
}

/// The number of a piece.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Number(u8);

impl Number {
    pub const FIRST: Number = Number(0x80);

    /// The number in a byte; `None` if it is none.
    pub const fn from_byte(byte: u8) -> Option<Number> {
        if byte >= Self::FIRST.0 { Some(Number(byte)) } else { None }
    }

    pub const fn byte(self) -> u8 {
        self.0
    }

    #[must_use]
    pub const fn next(self) -> Number {
        Number(self.0.wrapping_add(1) | Self::FIRST.0)
    }
}

/// A terminal's request.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Request {
    /// A text from its beginning.
    Begin(Topic),
    /// The piece after the one with this number.
    Next(Number),
}

impl Request {
    /// The request in a payload; `None` if it is none.
    pub const fn from_payload(payload: &[u8]) -> Option<Request> {
        match *payload {
            [b'a'] => Some(Request::Begin(Topic::All)),
            [b't'] => Some(Request::Begin(Topic::Tasks)),
            [b'c'] => Some(Request::Begin(Topic::Cpu)),
            [b'l'] => Some(Request::Begin(Topic::Counts)),
            [NEXT, number] => match Number::from_byte(number) {
                Some(number) => Some(Request::Next(number)),
                None => None,
            },
            _ => None,
        }
    }

    /// Hands its payload to `send`.
    pub fn with_payload<R>(self, send: impl FnOnce(&[u8]) -> R) -> R {
        match self {
            Request::Begin(topic) => send(&[topic as u8]),
            Request::Next(number) => send(&[NEXT, number.0]),
        }
    }
}

/// The piece in a payload; `None` if it is none.
pub fn piece(payload: &[u8]) -> Option<(Number, &[u8])> {
    let (&number, text) = payload.split_first()?;
    Some((Number::from_byte(number)?, text))
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    #[test]
    fn every_payload_is_a_request_or_a_piece_or_nothing() {
        let mut requests = 0;
        for first in 0..=u8::MAX {
            for second in [None].into_iter().chain((0..=u8::MAX).map(Some)) {
                let bytes = [first, second.unwrap_or(0)];
                let payload = if second.is_some() { &bytes[..] } else { &bytes[..1] };
                let request = Request::from_payload(payload);
                assert!(request.is_none() || piece(payload).is_none(), "{payload:?}");
                if let Some(request) = request {
                    request.with_payload(|same| assert_eq!(same, payload));
                    requests += 1;
                }
                let is_piece = piece(payload).is_some_and(|(number, _)| number.byte() == first);
                assert_eq!(is_piece, first >= 0x80);
            }
        }
        assert_eq!(requests, 4 + 128);
        assert_eq!(Request::from_payload(b""), None);
        assert_eq!(Request::from_payload(b"all"), None);
        assert_eq!(piece(b""), None);
    }

    #[test]
    fn numbers_return_after_all_others() {
        let mut number = Number::FIRST;
        for byte in 0x80..=0xff {
            assert_eq!(number.byte(), byte);
            assert_eq!(Number::from_byte(byte), Some(number));
            number = number.next();
        }
        assert_eq!(number, Number::FIRST);
    }
}
