//! The devices of one MCU, handed out once.

use avr_device::atmega128a::CPU;
use kernel::Boot;

use crate::adc::Adc;
use crate::eeprom::Eeprom;
use crate::external::External;
use crate::gpio::Pin;
use crate::pwm::Output;
use crate::reset::ResetCause;
use crate::soft_uart::SoftUart;
use crate::superbot::{
    Charger, ControlProbe, Emitters, JointDirection, JointPwm, LatchPwm, RollDirection, RollPwm,
};
use crate::tick::Tick;
use crate::trap::Trap;
use crate::twi::{I2c, Twi};
use crate::usart::{Usart0, Usart1};
use crate::watchdog::Watchdog;
use crate::{mcu, nonce};

/// The devices of this MCU, none of them started. They take no memory.
pub struct Board {
    pub tick: Tick,
    pub trap: Trap,
    #[cfg(feature = "cpu-time")]
    pub cpu_clock: crate::cpu_clock::CpuClock,
    pub usart0: Usart0,
    pub usart1: Usart1,
    pub soft_uart: SoftUart,
    pub twi: Twi,
    pub i2c: I2c,
    pub adc: Adc,
    pub eeprom: Eeprom,
    pub external: External,
    pub joint_pwm: JointPwm,
    pub joint_direction: JointDirection,
    pub roll_pwm: RollPwm,
    pub roll_direction: RollDirection,
    pub control_probe: ControlProbe,
    pub latch_pwm: LatchPwm,
    pub emitters: Emitters,
    pub charger: Charger,
    pub watchdog: Watchdog,
    /// Why the MCU started.
    pub reset_cause: ResetCause,
    /// A number that differs from boot to boot; see [`nonce`].
    pub nonce: u16,
}

impl Board {
    /// The devices, or `None` if they were taken before.
    ///
    /// From here on `sleep` means idle mode. The watchdog stays as it is.
    pub fn take(boot: &mut Boot) -> Option<Board> {
        mcu::take(boot)?;
        // SAFETY: the board is taken once, so nothing else uses these registers.
        let cpu = unsafe { CPU::steal() };
        Some(Board {
            tick: Tick::new(),
            trap: Trap::new(),
            #[cfg(feature = "cpu-time")]
            cpu_clock: crate::cpu_clock::CpuClock::new(),
            usart0: Usart0::new(),
            usart1: Usart1::new(),
            soft_uart: SoftUart::new(),
            twi: Twi::new(),
            i2c: I2c::new(),
            adc: Adc::new(),
            eeprom: Eeprom::new(),
            external: External::new(),
            joint_pwm: Output::new(),
            joint_direction: Pin::new(),
            roll_pwm: Output::new(),
            roll_direction: Pin::new(),
            control_probe: Pin::new(),
            latch_pwm: Output::new(),
            emitters: Pin::new(),
            charger: Pin::new(),
            watchdog: Watchdog::new(),
            reset_cause: ResetCause::take(&cpu),
            nonce: nonce::next(),
        })
    }
}
