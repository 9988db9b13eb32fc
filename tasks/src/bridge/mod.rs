//! What crosses from one MCU of a module to the other, over I2C.

pub mod protocol;
pub mod sender;
pub mod task;
