//! The devices of one MCU, handed out once.

use avr_device::atmega128a::{AC, CPU};
use kernel::{Boot, Context, MaskedCell};

use crate::adc::Adc;
use crate::eeprom::Eeprom;
use crate::external::External4;
use crate::gpio::Pin;
use crate::nonce;
use crate::pwm::Output;
use crate::reset::ResetCause;
use crate::superbot::{JointDirection, JointPwm, RollDirection, RollPwm};
use crate::tick::Tick;
use crate::twi::{I2c, Twi};
use crate::usart::{Usart0, Usart1};

static IS_TAKEN: MaskedCell<bool> = MaskedCell::new(false);

/// The devices of this MCU, none of them started. They take no memory.
pub struct Board {
    pub tick: Tick,
    pub usart0: Usart0,
    pub usart1: Usart1,
    pub twi: Twi,
    pub i2c: I2c,
    pub adc: Adc,
    pub eeprom: Eeprom,
    pub external4: External4,
    pub joint_pwm: JointPwm,
    pub joint_direction: JointDirection,
    pub roll_pwm: RollPwm,
    pub roll_direction: RollDirection,
    /// Why the MCU started.
    pub reset_cause: ResetCause,
    /// A number that differs from boot to boot; see [`nonce`].
    pub nonce: u16,
}

impl Board {
    /// The devices, or `None` if they were taken before.
    ///
    /// Readies what has no driver: idle is what `sleep` means from here on, and the analog comparator, the
    /// one device that runs out of reset without being needed, is switched off. The watchdog stays as it is.
    pub fn take(boot: &mut Boot) -> Option<Board> {
        let was_taken = boot.interrupt().mask(|masked| {
            let was_taken = IS_TAKEN.get(masked);
            IS_TAKEN.set(masked, true);
            was_taken
        });
        if was_taken {
            return None;
        }
        // SAFETY: the board is taken once, so nothing else uses these registers.
        let (cpu, comparator) = unsafe { (CPU::steal(), AC::steal()) };
        cpu.mcucr().write(|w| w.se().set_bit()); // the mode bits stay 0: idle
        comparator.acsr().write(|w| w.acd().set_bit());
        Some(Board {
            tick: Tick::new(),
            usart0: Usart0::new(),
            usart1: Usart1::new(),
            twi: Twi::new(),
            i2c: I2c::new(),
            adc: Adc::new(),
            eeprom: Eeprom::new(),
            external4: External4::new(),
            joint_pwm: Output::new(),
            joint_direction: Pin::new(),
            roll_pwm: Output::new(),
            roll_direction: Pin::new(),
            reset_cause: ResetCause::take(&cpu),
            nonce: nonce::next(),
        })
    }
}
