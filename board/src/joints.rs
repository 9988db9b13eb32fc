//! The joints' motors behind [`JointMotors`]: a bridge with a pin for its speed and one for its direction.

use embedded_hal::digital::OutputPin;
use kernel::{Context, Semaphore, Task};
use tasks::device::JointMotors;
use tasks::motor::FULL_DRIVE;
use tasks::motor::joint::Reading;

use crate::adc::{self, Rhythm};
use crate::gpio::{Output, PortB};
use crate::input::Input;
use crate::superbot::{
    ControlProbe, JOINT_CURRENT, JOINT_POTENTIOMETER, JointDirection, JointPwm, ROLL_CURRENT,
    ROLL_POTENTIOMETER, RollDirection, RollPwm,
};
use crate::{period, pwm};

const _: () = assert!(pwm::TOP == FULL_DRIVE as u16, "PWM_HZ and FULL_DRIVE do not fit each other");

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

    /// Adds the roll joint, on the master.
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
    fn drive(&mut self, task: &mut Task, joint: usize, drive: i16) {
        period::drive(task, joint, drive);
    }

    #[inline(always)]
    fn done(&mut self) {
        let Ok(()) = self.probe.set_low();
    }
}
