//! The joints' motors behind [`JointMotors`]: a bridge with a pin for its speed and one for its direction.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use kernel::{Semaphore, Task};
use tasks::device::JointMotors;
use tasks::motor::FULL_DRIVE;
use tasks::motor::joint::Reading;

use crate::adc::{Input, Rhythm};
use crate::gpio::{Output, PortB, PortC};
use crate::pwm::{self, Pwm, Timer1A, Timer1B};
use crate::superbot::{
    ControlProbe, JOINT_CURRENT, JOINT_POTENTIOMETER, JointDirection, JointPwm, ROLL_CURRENT,
    ROLL_POTENTIOMETER, RollDirection, RollPwm,
};

const _: () = assert!(pwm::TOP == FULL_DRIVE as u16, "PWM_HZ and FULL_DRIVE do not fit each other");

/// A motor's bridge.
struct Bridge<C, const BIT: u8> {
    speed: Pwm<C>,
    direction: Output<PortC, BIT>,
}

impl<C: pwm::Compare, const BIT: u8> Bridge<C, BIT> {
    fn drive(&mut self, drive: i16) {
        let Ok(()) = if drive < 0 { self.direction.set_low() } else { self.direction.set_high() };
        let Ok(()) = self.speed.set_duty_cycle(drive.unsigned_abs());
    }
}

/// The joint of the slave's half.
pub struct SlaveJoints {
    rhythm: Rhythm,
    joint: Bridge<Timer1A, 0>,
    probe: Output<PortB, 4>,
}

/// The joint of the master's half, and the roll joint.
pub struct MasterJoints {
    half: SlaveJoints,
    roll: Bridge<Timer1B, 1>,
}

impl SlaveJoints {
    /// The joint of this half.
    pub fn new(rhythm: Rhythm, speed: JointPwm, direction: JointDirection, probe: ControlProbe) -> Self {
        let joint = Bridge { speed: speed.start(), direction: direction.into_output() };
        SlaveJoints { rhythm, joint, probe: probe.into_output() }
    }

    fn reading(&mut self, task: &mut Task, potentiometer: Input, current: Input) -> Reading {
        Reading {
            potentiometer: self.rhythm.reading(task, potentiometer),
            current: self.rhythm.reading(task, current),
        }
    }
}

impl MasterJoints {
    /// The joint of this half and the roll joint.
    pub fn new(half: SlaveJoints, speed: RollPwm, direction: RollDirection) -> Self {
        MasterJoints { half, roll: Bridge { speed: speed.start(), direction: direction.into_output() } }
    }
}

impl JointMotors<1> for SlaveJoints {
    fn begin(&mut self, task: &mut Task, period: &'static Semaphore) {
        self.rhythm.begin(task, period, JOINT_CURRENT);
    }

    fn end(&mut self, task: &mut Task) {
        self.rhythm.end(task);
    }

    fn look(&mut self, task: &mut Task) {
        self.rhythm.look(task, JOINT_CURRENT);
    }

    #[inline(always)]
    fn readings(&mut self, task: &mut Task) -> [Reading; 1] {
        let Ok(()) = self.probe.set_high();
        [self.reading(task, JOINT_POTENTIOMETER, JOINT_CURRENT)]
    }

    #[inline(always)]
    fn drive(&mut self, [joint]: [i16; 1]) {
        self.joint.drive(joint);
        let Ok(()) = self.probe.set_low();
    }
}

impl JointMotors<2> for MasterJoints {
    fn begin(&mut self, task: &mut Task, period: &'static Semaphore) {
        self.half.rhythm.begin(task, period, ROLL_CURRENT);
    }

    fn end(&mut self, task: &mut Task) {
        self.half.rhythm.end(task);
    }

    fn look(&mut self, task: &mut Task) {
        self.half.rhythm.look(task, ROLL_CURRENT);
    }

    #[inline(always)]
    fn readings(&mut self, task: &mut Task) -> [Reading; 2] {
        let [joint] = self.half.readings(task);
        [joint, self.half.reading(task, ROLL_POTENTIOMETER, ROLL_CURRENT)]
    }

    #[inline(always)]
    fn drive(&mut self, [joint, roll]: [i16; 2]) {
        self.roll.drive(roll);
        self.half.drive([joint]);
    }
}
