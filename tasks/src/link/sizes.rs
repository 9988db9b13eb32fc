//! How many bytes a frame takes.

use crate::message::MAX_PAYLOAD;

/// The most bytes of a frame, before COBS: two before the payload, and a CRC of two.
pub const MAX_FRAME: usize = 2 + MAX_PAYLOAD + 2;

/// The most bytes that a frame takes on the wire, delimiter included.
pub const MAX_WIRE: usize = 1 + MAX_FRAME + 1;
