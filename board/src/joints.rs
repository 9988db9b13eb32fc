//! The joints' motors behind [`JointMotors`]: a bridge with a pin for its speed and one for its direction.
//!
//! A drive takes effect as the next period begins, in that period's interrupt. So it does so in time, however late the task
//! was that computed it.

use embedded_hal::digital::OutputPin;
use kernel::{Masked, MaskedCell, Semaphore, Task};
use tasks::device::JointMotors;
use tasks::motor::FULL_DRIVE;
use tasks::motor::joint::Reading;

use crate::adc::{self, Input, Rhythm};
use crate::gpio::{Output, Port, PortB, PortC};
use crate::pwm::{self, Compare, Timer1A, Timer1B};
use crate::superbot::{
    ControlProbe, JOINT_CURRENT, JOINT_POTENTIOMETER, JointDirection, JointPwm, ROLL_CURRENT,
    ROLL_POTENTIOMETER, RollDirection, RollPwm,
};

const _: () = assert!(pwm::TOP == FULL_DRIVE as u16, "PWM_HZ and FULL_DRIVE do not fit each other");

/// The drives of the next period: of the joint in this half, and of the roll joint.
static DRIVES: [MaskedCell<i16>; 2] = [const { MaskedCell::new(0) }; 2];

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
    fn reading(&self, masked: &Masked, joint: usize) -> Reading {
        let (potentiometer, current) = match joint {
            0 => (JOINT_POTENTIOMETER, JOINT_CURRENT),
            _ => (ROLL_POTENTIOMETER, ROLL_CURRENT),
        };
        let [potentiometer, current] = [potentiometer, current].map(|input| adc::reading(masked, input));
        Reading { potentiometer, current }
    }

    #[inline(always)]
    fn drive(&self, masked: &Masked, joint: usize, drive: i16) {
        if let Some(next) = DRIVES.get(joint) {
            next.set(masked, drive);
        }
    }

    #[inline(always)]
    fn done(&mut self) {
        let Ok(()) = self.probe.set_low();
    }
}

/// A period begins.
#[inline(always)]
pub(crate) fn begin_period(masked: &Masked) {
    PortB::set_output(1 << 4, true); // the probe
    apply(masked);
}

/// Puts the drives into effect.
#[inline(always)]
pub(crate) fn apply(masked: &Masked) {
    let [joint, roll] = &DRIVES;
    drive::<Timer1A, 0>(joint.get(masked));
    drive::<Timer1B, 1>(roll.get(masked));
}

/// Drives the motor with its speed at `C` and its direction at PC`BIT`.
#[inline(always)]
fn drive<C: Compare, const BIT: u8>(drive: i16) {
    PortC::set_output(1 << BIT, drive >= 0);
    C::set(drive.unsigned_abs());
}
