//! A dock's link: messages to and from the neighbour, over a serial line that loses, corrupts and reflects.
//!
//! ```text
//!   message -> frame (header, CRC) -> COBS -> wire -> COBS -> frame -> endpoint -> message
//!                                                               |
//!                                            ARQ: deliver, acknowledge, or drop
//! ```
//!
//! Three state machines at each dock decide: the [`endpoint::Endpoint`] what a frame that comes in means, the
//! [`receiver::Receiver`] what is done with it, and the [`sender::Sender`] which frame goes out next. Two
//! tasks drive them: [`send`] and [`receive`]. Other code that has a line and a clock can, too.

pub mod arq;
pub mod backoff;
pub mod cobs;
pub mod counters;
pub mod crc;
pub mod endpoint;
pub mod frame;
pub mod port;
pub mod receive;
pub mod receiver;
pub mod send;
pub mod sender;
pub mod signature;
pub mod sizes;
