//! Corrects simavr where it differs from the ATmega128.

pub(crate) mod absent;
pub(crate) mod adc;
pub(crate) mod eeprom;
pub(crate) mod external;
pub(crate) mod flags;
mod incoming;
pub(crate) mod interrupt;
pub(crate) mod pins;
pub(crate) mod ports;
pub(crate) mod rampz;
pub(crate) mod reset_flags;
pub(crate) mod sleep;
pub(crate) mod spi;
pub(crate) mod spm;
pub(crate) mod timer;
pub(crate) mod twi;
pub(crate) mod unread;
pub(crate) mod usart;
pub(crate) mod watchdog;
pub(crate) mod zeros;
