//! The MCU: the registers, vectors and pins in which the MCUs differ that the kernel is tested on.
//!
//! Each MCU has a file that provides these names:
//! - `MARK`: the I/O address of the register that takes the program's marks;
//! - `set_up`: sets up what has no driver;
//! - `start_tick`: starts the timer behind the tick;
//! - `start_timer2`, `enable_timer2`: the timer behind single steps, and its interrupt;
//! - `start_external`: starts the one external interrupt that is in use;
//! - `hold_external`, `release_external`: keep back all external interrupts for a while;
//! - the macros `tick_interrupt!`, `external_interrupt!` and `trap_interrupt!`: the vectors of these three.

use kernel::{Boot, Context, MaskedCell};

#[cfg(feature = "atmega128")]
mod atmega128;
#[cfg(feature = "atmega1284p")]
mod atmega1284p;
#[cfg(feature = "atmega2560")]
mod atmega2560;
#[cfg(feature = "atmega328p")]
mod atmega328p;
#[cfg(not(any(feature = "atmega128", feature = "qemu")))]
mod chip;
#[cfg(not(feature = "atmega128"))]
mod later;
#[cfg(feature = "qemu")]
mod qemu;

#[cfg(all(feature = "atmega128", not(feature = "tickless")))]
pub(crate) use atmega128::start_tick;
#[cfg(feature = "atmega128")]
pub(crate) use atmega128::{
    MARK, enable_timer2, hold_external, release_external, set_up, start_external, start_timer2,
};
#[cfg(feature = "atmega328p")]
use atmega328p as registers;
#[cfg(feature = "atmega1284p")]
use atmega1284p as registers;
#[cfg(feature = "atmega2560")]
use atmega2560 as registers;
#[cfg(not(any(feature = "atmega128", feature = "qemu")))]
pub(crate) use chip::{MARK, start_external, start_tick};
#[cfg(not(feature = "atmega128"))]
pub(crate) use later::{enable_timer2, hold_external, release_external, set_up, start_timer2};
#[cfg(feature = "qemu")]
pub(crate) use qemu::{start_external, start_tick};

#[cfg(not(any(
    feature = "atmega128",
    feature = "atmega328p",
    feature = "atmega1284p",
    feature = "atmega2560"
)))]
compile_error!("no MCU: enable one of the features atmega128, atmega328p, atmega1284p, atmega2560");

#[cfg(all(feature = "qemu", not(any(feature = "atmega328p", feature = "atmega2560"))))]
compile_error!("QEMU has this MCU not: with the feature qemu enable one of atmega328p, atmega2560");

static IS_TAKEN: MaskedCell<bool> = MaskedCell::new(false);

/// Prepares the MCU: from here on `sleep` means idle mode, and the analog comparator is switched off, the one
/// device that runs after reset without being needed. `None` if it was taken before.
pub(crate) fn take(boot: &mut Boot) -> Option<()> {
    boot.mask(|masked| {
        let was_taken = IS_TAKEN.get(masked);
        IS_TAKEN.set(masked, true);
        (!was_taken).then(set_up)
    })
}
