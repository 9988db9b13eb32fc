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
//! #![feature(abi_avr_interrupt, asm_experimental_arch)] // what the vectors are made of
//!
//! board::interrupts!(Interrupts: Tick, Usart0);
//!
//! kernel::main!(|boot| {
//!     let Some(board) = Board::take(boot) else { return };
//!     board.tick.start(Interrupts);
//!     let (mut transmitter, receiver) = board.usart0.start(Interrupts);
//!     ...
//! });
//! ```
//!
//! A Cargo feature selects the MCU: `atmega128`, the default, or `atmega328p`, `atmega1284p` or `atmega2560`.
//! Those three have what the kernel's tests need and no more. With the feature `qemu` a program is for QEMU's
//! model of the ATmega328P or the ATmega2560.
//!
//! Devices exist on the AVR only. The modules that decide without touching a device, [`twi::engine`],
//! [`twi::transaction`], [`soft_uart::decoder`], [`soft_uart::encoder`] and the inbox of serial lines, are
//! tested on the host.

#![no_std]
#![cfg_attr(target_arch = "avr", feature(asm_experimental_arch))]

// On every MCU.
#[cfg(all(target_arch = "avr", not(feature = "qemu")))]
pub mod debug;
#[cfg(all(target_arch = "avr", feature = "qemu"))]
#[path = "qemu.rs"]
pub mod debug;
#[cfg(target_arch = "avr")]
pub mod external;
#[cfg(target_arch = "avr")]
pub mod interrupts;
#[cfg(target_arch = "avr")]
mod mcu;
#[cfg(target_arch = "avr")]
pub mod sleep;
#[cfg(all(target_arch = "avr", not(feature = "tickless")))]
pub mod tick;
#[cfg(all(target_arch = "avr", feature = "tickless"))]
#[path = "tickless.rs"]
pub mod tick;
#[cfg(target_arch = "avr")]
pub mod trap;

// On SuperBot's.
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod adc;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
mod board;
#[cfg(all(target_arch = "avr", feature = "atmega128", feature = "cpu-time"))]
pub mod cpu_clock;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod deferred;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod delay;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod eeprom;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod gpio;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
mod guarded;
#[cfg(all(test, not(target_arch = "avr")))]
#[path = "serial/inbox.rs"]
mod inbox;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod input;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod joints;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
mod memory;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod nonce;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod panic;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod period;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod peripherals;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod pwm;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod reset;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod serial;
#[cfg(any(not(target_arch = "avr"), feature = "atmega128"))]
pub mod soft_uart;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod superbot;
#[cfg(any(not(target_arch = "avr"), feature = "atmega128"))]
pub mod twi;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod usart;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub mod watchdog;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
mod with_task;

#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub use board::Board;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
use superbot as description;
#[cfg(all(target_arch = "avr", feature = "atmega128"))]
pub use with_task::WithTask;

// On the others.
#[cfg(all(target_arch = "avr", not(feature = "atmega128")))]
pub mod bare;

#[cfg(all(target_arch = "avr", not(feature = "atmega128")))]
use bare as description;
#[cfg(all(target_arch = "avr", not(feature = "atmega128")))]
pub use bare::Board;

/// For the expansion of [`interrupts!`].
#[cfg(target_arch = "avr")]
#[doc(hidden)]
pub use kernel;
