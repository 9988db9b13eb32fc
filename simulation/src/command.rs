//! What a remote control sends.

use tasks::dock::Dock;
use tasks::link::cobs::WireBuffer;
use tasks::link::frame::{Frame, Label, Turn};
use tasks::link::signature::Signature;
use tasks::message::TaskCode;

use crate::hardware::MILLISECOND;

/// When it sends a message, in cycles from the first time: a dock that sends itself hears nothing. Who has
/// heard it takes the others for repeated.
pub const SENDS: [u64; 3] = [0, 15 * MILLISECOND, 30 * MILLISECOND];

/// The label of a message that comes in at a dock from outside. `number` tells it from the one before.
pub(crate) fn label(at: Dock, number: u8) -> Label {
    // A dock takes what bears its own number and epoch for its own light.
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
