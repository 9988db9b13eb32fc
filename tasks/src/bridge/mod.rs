//! The bridge between the MCUs of a module: messages cross it over I2C.

pub mod protocol;
pub mod sender;
pub mod task;
