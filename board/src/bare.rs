//! A board with nothing but its MCU, which is none of SuperBot's: only what the kernel's tests need.

use kernel::Boot;

use crate::external::External;
use crate::mcu;
use crate::tick::Tick;
use crate::trap::Trap;

/// The MCU's clock, in Hz.
pub const CLOCK_HZ: u32 = 16_000_000;

/// The kernel's ticks per second.
pub const TICK_HZ: u32 = 1_000;

/// The devices of this MCU, none of them started. They take no memory.
pub struct Board {
    pub tick: Tick,
    pub trap: Trap,
    pub external: External,
}

impl Board {
    /// The devices, or `None` if they were taken before. From here on `sleep` means idle mode.
    pub fn take(boot: &mut Boot) -> Option<Board> {
        mcu::take(boot).map(|()| Board { tick: Tick::new(), trap: Trap::new(), external: External::new() })
    }
}
