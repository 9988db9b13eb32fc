//! Shows the frames at a dock on a timeline.

use serde_json::{Value, json};
use simavr_harness::{Character, Slice};
use tasks::link::frame::{Frame, FrameError};
use tasks::message::TaskCode;

use super::events::{Events, Track};

/// The byte at which a frame ends.
const DELIMITER: u8 = 0;

/// The characters of a frame follow each other within this many times their own length.
const PAUSE: u64 = 3;

/// The bytes on a wire up to a delimiter or a pause.
pub type Piece = Slice<Vec<u8>>;

/// Joins characters to pieces, in the order in which they begin.
pub fn pieces(characters: &[Character]) -> Vec<Piece> {
    let mut characters = characters.to_vec();
    characters.sort_by_key(|character| (character.start, character.end));
    let mut pieces: Vec<Piece> = Vec::new();
    for Character { value, start, end } in characters {
        let pause = PAUSE * (end - start);
        match pieces.last_mut() {
            Some(piece) if piece.what.last() != Some(&DELIMITER) && start < piece.end + pause => {
                piece.what.push(value);
                piece.end = piece.end.max(end);
            }
            _ => pieces.push(Slice { begin: start, end, what: vec![value] }),
        }
    }
    pieces
}

/// Writes pieces on a track, up to the `end` of the run. If two senders overlap, the later piece begins only
/// when the earlier one ends.
pub fn write(events: &mut Events, track: Track, name: &str, pieces: &[Piece], end: u64) {
    if pieces.is_empty() {
        return;
    }
    events.name_track(track, name);
    let mut free_at = 0;
    for piece in pieces {
        let (begin, end) = (piece.begin.max(free_at), piece.end.min(end));
        if begin < end {
            let (name, args) = describe(&piece.what);
            events.begin(track, begin, "frame", &name, args);
            events.end(track, end);
            free_at = end;
        }
    }
}

/// Describes a frame: a short name, and details.
pub fn describe(bytes: &[u8]) -> (String, Value) {
    let hexadecimal = bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    let mut decoded = bytes.to_vec();
    match Frame::decode(&mut decoded) {
        Ok(Frame::Data { label, to, payload }) => (
            format!("message to {}", behaviour(to)),
            json!({ "bytes": hexadecimal, "turn": format!("{:?}", label.turn), "payload": payload }),
        ),
        Ok(Frame::Ack(label)) => {
            ("ACK".into(), json!({ "bytes": hexadecimal, "turn": format!("{:?}", label.turn) }))
        }
        Ok(Frame::Datagram { to, payload, .. }) => {
            (format!("datagram to {}", behaviour(to)), json!({ "bytes": hexadecimal, "payload": payload }))
        }
        Err(error) => {
            let why = match error {
                FrameError::Cobs => "not a whole frame",
                FrameError::Length => "a frame of a wrong length",
                FrameError::Crc => "a frame with a wrong CRC",
                FrameError::Control => "a frame from no dock",
            };
            (why.into(), json!({ "bytes": hexadecimal }))
        }
    }
}

fn behaviour(task: TaskCode) -> &'static str {
    match task {
        TaskCode::AC_RECEIVE => "AC_RECEIVE",
        TaskCode::HORMONE => "HORMONE",
        TaskCode::CONSOLE => "CONSOLE",
        _ => "an unknown behaviour",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn characters(at: u64, bytes: &[u8]) -> impl Iterator<Item = Character> {
        let starts = (at..).step_by(4160);
        bytes.iter().zip(starts).map(|(&value, start)| Character { value, start, end: start + 4160 })
    }

    #[test]
    fn a_piece_ends_with_a_delimiter_or_before_a_pause() {
        let sent: Vec<_> = characters(0, &[1, 2, 0, 3, 0])
            .chain(characters(100_000, &[4]))
            .chain(characters(130_000, &[5]))
            .collect();
        let pieces = pieces(&sent);
        let bytes: Vec<&[u8]> = pieces.iter().map(|piece| &piece.what[..]).collect();
        assert_eq!(bytes, [&[1, 2, 0][..], &[3, 0], &[4], &[5]]);
        assert_eq!((pieces[1].begin, pieces[1].end), (3 * 4160, 5 * 4160));
    }

    #[test]
    fn what_is_no_frame_says_so() {
        assert_eq!(describe(&[4]).0, "not a whole frame");
        assert_eq!(describe(&[1, 2, 0]).1["bytes"], "01 02 00");
    }
}
