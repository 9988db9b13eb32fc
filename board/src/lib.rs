//! The ATmega128 boards of a SuperBot module. The one crate that names a register or a pin.
//!
//! [`superbot`] describes the boards; with the real schematic at hand, that file is what changes. The
//! other modules drive the MCU's devices behind the traits of embedded-hal 1.0, embedded-io and
//! [`tasks::device`].
//!
//! [`Board::take`] hands out every device, once. A device takes RAM, flash and interrupt vectors only
//! in a program that starts it, and it can be started only with its vectors in place:
//!
//! ```text
//! #![feature(asm_experimental_arch)] // what the vectors are made of
//!
//! board::interrupts!(Interrupts: Tick, Usart0);
//!
//! kernel::run(|boot| {
//!     let Some(board) = Board::take(boot) else { return };
//!     board.tick.start(Interrupts);
//!     let (mut transmitter, receiver) = board.usart0.start(Interrupts);
//!     ...
//! })
//! ```
//!
//! Devices exist on the AVR only. What decides without touching one, [`twi::engine`] and
//! [`twi::transaction`], is tested on the host.

#![no_std]
#![cfg_attr(target_arch = "avr", feature(asm_experimental_arch))]

#[cfg(target_arch = "avr")]
pub mod adc;
#[cfg(target_arch = "avr")]
mod board;
#[cfg(target_arch = "avr")]
pub mod debug;
#[cfg(target_arch = "avr")]
pub mod delay;
#[cfg(target_arch = "avr")]
pub mod eeprom;
#[cfg(target_arch = "avr")]
pub mod external;
#[cfg(target_arch = "avr")]
pub mod gpio;
#[cfg(target_arch = "avr")]
pub mod interrupts;
#[cfg(target_arch = "avr")]
pub mod nonce;
#[cfg(target_arch = "avr")]
pub mod panic;
#[cfg(target_arch = "avr")]
pub mod pwm;
#[cfg(target_arch = "avr")]
pub mod reset;
#[cfg(target_arch = "avr")]
pub mod superbot;
#[cfg(target_arch = "avr")]
pub mod tick;
pub mod twi;
#[cfg(target_arch = "avr")]
pub mod usart;
#[cfg(target_arch = "avr")]
mod with_task;

#[cfg(target_arch = "avr")]
pub use board::Board;
#[cfg(target_arch = "avr")]
pub use with_task::WithTask;

/// For the expansion of [`interrupts!`].
#[cfg(target_arch = "avr")]
#[doc(hidden)]
pub use kernel;
