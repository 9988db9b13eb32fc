//! All tests of the harness with small programs of their own, in one program: it is compiled and linked once.
//! `cargo test -p superbot-simavr-harness twi::` runs those of one file.

mod common;

mod adc;
mod coverage;
mod eeprom;
mod external;
mod flags;
mod interrupt;
mod masked;
mod pins;
mod program;
mod robot;
mod serial_pins;
mod sleep;
mod spi;
mod spm;
mod timer3;
mod timers;
mod twi;
mod usart;
