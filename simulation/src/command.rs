//! The messages of a remote control.

use tasks::dock::Dock;
use tasks::link::cobs::WireBuffer;
use tasks::link::frame::{Frame, Label, Turn};
use tasks::link::signature::Signature;
use tasks::message::TaskCode;

use crate::hardware::MILLISECOND;

/// When a remote control sends a message, in cycles from the first time. It sends several times, because a
/// dock that is sending itself hears nothing. A dock that has heard one of them takes the others for
/// repetitions.
pub const SENDS: [u64; 3] = [0, 15 * MILLISECOND, 30 * MILLISECOND];

/// The label of a message that comes in at a dock from outside. `number` tells it from the one before.
pub(crate) fn label(at: Dock, number: u8) -> Label {
    // A dock takes a frame that bears its own number and epoch for its own light.
    let dock = if at == Dock::Front { Dock::Back } else { Dock::Front };
    Label { signature: Signature { dock, epoch: number }, turn: Turn::First }
}

/// The bytes on the wire of such a message to HORMONE.
pub fn command(at: Dock, number: u8, payload: &[u8]) -> Vec<u8> {
    let label = label(at, number);
    let mut wire = WireBuffer::new();
    let frame = Frame::Data { label, to: TaskCode::HORMONE, payload };
    // A payload too long for a frame is no message: nothing is sent.
    frame.encode(&mut wire).map_or_else(|_| Vec::new(), |()| wire.bytes().to_vec())
}

#[cfg(test)]
mod tests {
    use tasks::message::MAX_PAYLOAD;

    use super::*;

    #[test]
    fn a_command_is_sent_three_times_15_ms_apart() {
        assert_eq!(SENDS.map(|at| at as f64 / MILLISECOND as f64), [0.0, 15.0, 30.0]);
    }

    #[test]
    fn a_command_is_a_frame_that_no_dock_takes_for_its_own() {
        for at in Dock::ALL {
            let [one, next] = [3, 4].map(|number| label(at, number));
            assert_ne!(one.signature.dock, at);
            assert_ne!(one, next, "a message and the next differ, else the second was a repetition");
            let bytes = |length: usize| command(at, 3, &vec![0xd2; length]);
            // The payload, label, destination and CRC, as COBS with its delimiter.
            for length in [0, 1, MAX_PAYLOAD] {
                assert_eq!(bytes(length).iter().filter(|byte| **byte == 0).count(), 1, "{length} bytes");
                assert_eq!(bytes(length).len(), bytes(0).len() + length, "{length} bytes");
            }
            assert_eq!(bytes(MAX_PAYLOAD + 1), [], "it fits no frame");
        }
    }
}
