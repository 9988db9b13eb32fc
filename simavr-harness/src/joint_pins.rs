//! The pins and registers of the MCUs to which the motors of a module's joints are wired, as in
//! `board/src/superbot.rs`.

use tasks::motor::Axis;

use crate::Controller;

/// Data addresses.
pub const TCCR1A: u16 = 0x4f;
pub const TCCR1B: u16 = 0x4e;
pub const ICR1: u16 = 0x46;
pub const PORTB: u16 = 0x38;
pub const PORTC: u16 = 0x35;

/// The wiring of a joint's bridge, and the inputs that measure the joint.
pub struct JointWiring {
    pub controller: Controller,
    pub axis: Axis,
    /// Data address of the compare register, the bit of TCCR1A that connects its pin to the timer, and that
    /// pin's bit of port B.
    pub compare: u16,
    pub connected: u8,
    pub pin: u8,
    /// The bit of PORTC that gives the direction.
    pub direction: u8,
    /// The inputs of the converter.
    pub potentiometer: usize,
    pub current: usize,
}

impl JointWiring {
    /// The bits of TCCR1A that say what a match does to the pin: COM1x1, which connects it, and COM1x0.
    pub const fn output_mode(&self) -> u8 {
        self.connected | self.connected >> 1
    }
}

pub const JOINTS: [JointWiring; 3] = [
    half_joint(Controller::Master, Axis::Front),
    JointWiring {
        controller: Controller::Master,
        axis: Axis::Roll,
        compare: 0x48,
        connected: 1 << 5,
        pin: 6,
        direction: 1,
        potentiometer: 2,
        current: 3,
    },
    half_joint(Controller::Slave, Axis::Back),
];

const fn half_joint(controller: Controller, axis: Axis) -> JointWiring {
    JointWiring {
        controller,
        axis,
        compare: 0x4a,
        connected: 1 << 7,
        pin: 5,
        direction: 0,
        potentiometer: 0,
        current: 1,
    }
}
