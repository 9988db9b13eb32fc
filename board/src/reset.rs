//! The cause of the last reset.

use avr_device::atmega128a::CPU;

/// The causes of the last reset (ATmega128 datasheet, "MCU Control and Status Register – MCUCSR").
/// At power-up the brown-out detector may report as well.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct ResetCause(u8);

impl ResetCause {
    /// None known.
    pub const NONE: ResetCause = ResetCause(0);

    const POWER_ON: u8 = 1 << 0;
    const EXTERNAL: u8 = 1 << 1;
    const BROWN_OUT: u8 = 1 << 2;
    const WATCHDOG: u8 = 1 << 3;
    const JTAG: u8 = 1 << 4;

    /// Reads the flags, and clears them: hardware only sets them.
    pub(crate) fn take(cpu: &CPU) -> ResetCause {
        let flags = cpu.mcucsr().read().bits();
        cpu.mcucsr().reset();
        ResetCause(flags)
    }

    /// The flags as they stood in MCUCSR.
    pub fn flags(self) -> u8 {
        self.0
    }

    /// The supply voltage rose at power-up.
    pub fn is_power_on(self) -> bool {
        self.0 & Self::POWER_ON != 0
    }

    /// The RESET pin was low.
    pub fn is_external(self) -> bool {
        self.0 & Self::EXTERNAL != 0
    }

    /// The supply voltage dropped.
    pub fn is_brown_out(self) -> bool {
        self.0 & Self::BROWN_OUT != 0
    }

    /// The watchdog was not fed in time.
    pub fn is_watchdog(self) -> bool {
        self.0 & Self::WATCHDOG != 0
    }

    /// A debugger requested it.
    pub fn is_jtag(self) -> bool {
        self.0 & Self::JTAG != 0
    }
}
