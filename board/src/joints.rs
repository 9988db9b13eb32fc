//! The joints' motors behind [`JointMotors`]: a bridge with a pin for its speed and one for its direction.
//!
//! A drive takes effect as the next period begins, in that period's interrupt. So it does so in time, however late the task
//! was that computed it. The vectors that come before that interrupt look whether it is due, and begin the period in its stead: of
//! what may keep it waiting, they never add to the rest.

use core::arch::asm;
use core::mem::offset_of;

use embedded_hal::digital::OutputPin;
use kernel::{Context, Masked, MaskedCell, Semaphore, Task};
use tasks::device::JointMotors;
use tasks::motor::FULL_DRIVE;
use tasks::motor::joint::Reading;

use crate::adc::{self, Input, Rhythm};
use crate::gpio::{Output, Port, PortB};
use crate::pwm;
use crate::superbot::{
    ControlProbe, JOINT_CURRENT, JOINT_POTENTIOMETER, JointDirection, JointPwm, ROLL_CURRENT,
    ROLL_POTENTIOMETER, RollDirection, RollPwm,
};

const _: () = assert!(pwm::TOP == FULL_DRIVE as u16, "PWM_HZ and FULL_DRIVE do not fit each other");

/// What a period begins with.
#[repr(C)]
struct Period {
    state: MaskedCell<u8>,
    /// The directions, bits of PORTC: of the joint in this half, and of the roll joint.
    directions: MaskedCell<u8>,
    /// Their speeds.
    speeds: [MaskedCell<u16>; 2],
}

static PERIOD: Period = Period {
    state: MaskedCell::new(IS_OFF),
    directions: MaskedCell::new(DIRECTIONS),
    speeds: [const { MaskedCell::new(0) }; 2],
};

/// The joints are not controlled.
const IS_OFF: u8 = 0;
/// The next period has not begun.
const IS_AWAITED: u8 = 1;
/// It has, and its interrupt has not come yet.
const HAS_BEGUN: u8 = 2;

/// PORTC: PC0 and PC1.
const DIRECTIONS: u8 = 0b11;

/// The joints of this MCU.
pub struct Joints {
    rhythm: Rhythm,
    probe: Output<PortB, 4>,
    /// The highest input that belongs to them.
    highest: Input,
}

impl Joints {
    /// The joint of this half alone, as on the slave.
    pub fn new(rhythm: Rhythm, speed: JointPwm, direction: JointDirection, probe: ControlProbe) -> Self {
        speed.start();
        direction.into_output();
        Joints { rhythm, probe: probe.into_output(), highest: JOINT_CURRENT }
    }

    /// And the roll joint, on the master.
    pub fn with_roll(self, speed: RollPwm, direction: RollDirection) -> Self {
        speed.start();
        direction.into_output();
        Joints { highest: ROLL_CURRENT, ..self }
    }
}

impl JointMotors for Joints {
    fn begin(&mut self, task: &mut Task, period: &'static Semaphore) {
        self.rhythm.begin(task, period, self.highest);
    }

    fn end(&mut self, task: &mut Task) {
        self.rhythm.end(task);
    }

    fn look(&mut self, task: &mut Task) {
        self.rhythm.look(task, self.highest);
    }

    #[inline(always)]
    fn reading(&self, task: &mut Task, joint: usize) -> Reading {
        let (potentiometer, current) = match joint {
            0 => (JOINT_POTENTIOMETER, JOINT_CURRENT),
            _ => (ROLL_POTENTIOMETER, ROLL_CURRENT),
        };
        let mut last = |input| task.mask(|masked| adc::reading(masked, input));
        let (potentiometer, current) = (last(potentiometer), last(current));
        Reading { potentiometer, current }
    }

    #[inline(always)]
    fn drive(&self, masked: &Masked, joint: usize, drive: i16) {
        if let Some(speed) = PERIOD.speeds.get(joint) {
            speed.set(masked, drive.unsigned_abs());
            let bit = 1 << (joint & 1);
            let others = PERIOD.directions.get(masked) & !bit;
            PERIOD.directions.set(masked, if drive >= 0 { others | bit } else { others });
        }
    }

    #[inline(always)]
    fn done(&mut self) {
        let Ok(()) = self.probe.set_low();
    }
}

/// The joints are controlled from now on, or no longer: then the last drives are put into effect.
#[inline(always)]
pub(crate) fn control(masked: &Masked, is_on: bool) {
    PERIOD.state.set(masked, IS_AWAITED);
    if !is_on {
        begin_period();
        PortB::set_output(1 << 4, false); // the probe
    }
    PERIOD.state.set(masked, if is_on { IS_AWAITED } else { IS_OFF });
}

/// The period's interrupt has come.
#[inline(always)]
pub(crate) fn await_next(masked: &Masked) {
    if PERIOD.state.get(masked) == HAS_BEGUN {
        PERIOD.state.set(masked, IS_AWAITED);
    }
}

/// Begins the period, if it has not begun: raises the probe, and puts the drives into effect. Interrupts are masked. It changes
/// r24, r30 and SREG, for the vectors that call it. 40 cycles with the call.
///
/// In a function without locals the compiler adds nothing to the assembly but a `ret`.
#[doc(hidden)]
#[inline(never)]
pub extern "C" fn begin_period() {
    // SAFETY: PORTC changes with interrupts masked only, the compare units' registers here only; PB4 is the probe.
    unsafe {
        asm!(
            "lds r30, {period}+{state}",      // 2
            "cpi r30, {is_awaited}",          // 1
            "brne 2f",                        // 1, or 2
            "ldi r30, {has_begun}",           // 1
            "sts {period}+{state}, r30",      // 2
            "sbi 0x18, 4",                    // 2: PORTB, the probe
            "in r30, 0x15",                   // 1: PORTC
            "andi r30, 0xff - {pins}",        // 1
            "lds r24, {period}+{directions}", // 2
            "or r30, r24",                    // 1
            "out 0x15, r30",                  // 1
            "lds r24, {period}+{speeds}+1",   // 2
            "out 0x2b, r24",                  // 1: OCR1AH
            "lds r24, {period}+{speeds}",     // 2
            "out 0x2a, r24",                  // 1: OCR1AL
            "lds r24, {period}+{speeds}+3",   // 2
            "out 0x29, r24",                  // 1: OCR1BH
            "lds r24, {period}+{speeds}+2",   // 2
            "out 0x28, r24",                  // 1: OCR1BL
            "2:",
            period = sym PERIOD,
            state = const offset_of!(Period, state),
            directions = const offset_of!(Period, directions),
            speeds = const offset_of!(Period, speeds),
            is_awaited = const IS_AWAITED,
            has_begun = const HAS_BEGUN,
            pins = const DIRECTIONS,
            out("r24") _,
            out("r30") _,
            options(nostack),
        );
    }
}
