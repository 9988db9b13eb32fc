//! What crosses a dock: messages to and from the neighbour, over a serial line that loses,
//! corrupts and reflects.
//!
//! ```text
//!   message -> frame (header, CRC) -> COBS -> wire -> COBS -> frame -> endpoint -> message
//!                                                               |
//!                                            ARQ: deliver, acknowledge, or drop
//! ```
//!
//! An [`endpoint::Endpoint`] at each dock decides what becomes of each frame. Two tasks drive it:
//! one sends and keeps the time-out, one receives.

pub mod arq;
pub mod backoff;
pub mod cobs;
pub mod counters;
pub mod crc;
pub mod endpoint;
pub mod frame;
pub mod port;
pub mod receive;
pub mod send;
pub mod signature;
