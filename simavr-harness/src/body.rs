//! The body of a module: joints, latches and battery, wired to the pins of both MCUs as
//! `board/src/superbot.rs` has it.

use plants::battery::{Battery, IDLE_AMPERES};
use plants::dock::Latch;
use plants::joint::Joint;
use plants::motor::Motor;
use simulation::{Angles, CLOCK_HZ};
use tasks::dock::{Dock, DockSet};
use tasks::docking::latch::End;
use tasks::motor::Axis;
use tasks::superbot::{MASTER, SLAVE};

use crate::controller::Controller;
use crate::joint_pins::{ICR1, JOINTS, JointWiring, PORTC, TCCR1A, TCCR1B};
use crate::mcu::Mcu;
use crate::part::Pin;
use crate::repair::adc::Multiplexer;

/// The body follows the pins in steps of so many cycles: 0.1 ms.
pub(crate) const STEP: u64 = 1600;

/// A step, in s.
const SECONDS: f64 = STEP as f64 / CLOCK_HZ as f64;

/// Steps of the equations in one of the body.
const PARTS: u32 = 2;

/// The multiplexer before ADC7.
const MULTIPLEXER: Multiplexer = Multiplexer {
    pin: 7,
    address: [Pin { port: 'G', bit: 0 }, Pin { port: 'G', bit: 1 }, Pin { port: 'G', bit: 2 }],
};

// Data addresses: a look at a register is far cheaper than asking simavr for a pin's level.
const TCNT1H: u16 = 0x4d;
const TCNT1L: u16 = 0x4c;
const PORTD: u16 = 0x32;
const PORTB: u16 = 0x38;

/// Timer1's registers and port C. The body alone follows these, so that simavr need not: it would count each
/// pulse of the motors, 20,000 a second, and tell each pin of its level.
const FOLLOWED: [u16; 13] =
    [PORTC, ICR1, 0x47, 0x48, 0x49, 0x4a, 0x4b, TCNT1L, TCNT1H, TCCR1B, TCCR1A, 0x78, 0x79];

/// The docks of each half, by their places.
const DOCKS: [(Controller, [Dock; 3]); 2] =
    [(Controller::Master, MASTER.docks()), (Controller::Slave, SLAVE.docks())];

/// A module's body, to be looked at and interfered with between runs.
#[derive(Clone, Debug)]
pub struct Body {
    joints: [Joint; 3],
    /// Where a world moves the joints.
    driven: Option<Driven>,
    latches: [Latch; 6],
    /// Docks whose motors have moved their latches to an end, and to which.
    arrivals: Vec<(Dock, End)>,
    /// What was last shown of the switches at their ends: released, latched.
    switches: [[Option<bool>; 2]; 6],
    /// What flows out of each dock while its power switch is closed, in A. What flows in reaches the battery
    /// by its charger.
    pub dock_amperes: [f64; 6],
    /// What each dock sees reflected by something that is no dock of the robot, in counts of the converter.
    pub proximity: [u16; 6],
    /// Likewise by other docks of the robot.
    reflected: [u16; 6],
    pub battery: Battery,
    /// Of both boards, in degrees Celsius.
    pub celsius: [f64; 2],
    /// Along x, y and z of the half with the Front dock, in multiples of the acceleration of gravity: as the
    /// robot lies.
    pub(crate) acceleration: [f64; 3],
}

/// What the motors of a body had since the world last asked.
#[derive(Clone, Copy, Debug, Default)]
struct Driven {
    /// The sum over the steps, in V.
    volts: [f64; 3],
    steps: u32,
}

impl Default for Body {
    /// A module that lies still, straight and released from all others, with a full battery.
    fn default() -> Self {
        Body {
            joints: [0.0; 3].map(Joint::at),
            driven: None,
            latches: [0.0; 6].map(Latch::at),
            arrivals: Vec::new(),
            switches: [[None; 2]; 6],
            dock_amperes: [0.0; 6],
            proximity: [0; 6],
            reflected: [0; 6],
            battery: Battery::at_power_up(),
            celsius: [25.0; 2],
            acceleration: [0.0, 0.0, 1.0],
        }
    }
}

impl Body {
    pub fn joint(&self, axis: Axis) -> &Joint {
        &self.joints[usize::from(axis.index())]
    }

    pub fn joint_mut(&mut self, axis: Axis) -> &mut Joint {
        &mut self.joints[usize::from(axis.index())]
    }

    pub fn latch(&self, dock: Dock) -> &Latch {
        &self.latches[usize::from(dock.index())]
    }

    pub fn latch_mut(&mut self, dock: Dock) -> &mut Latch {
        &mut self.latches[usize::from(dock.index())]
    }

    /// The angles of the joints.
    pub fn angles(&self) -> Angles {
        self.joints.each_ref().map(Joint::degrees)
    }

    /// Gives all joints such a motor.
    pub(crate) fn set_motor(&mut self, motor: Motor) {
        self.joints.iter_mut().for_each(|joint| joint.motor = motor);
    }

    /// From now on a world moves the joints. Returns the mean voltage at each motor since it last asked, in
    /// V.
    pub(crate) fn take_volts(&mut self) -> [f64; 3] {
        let Driven { volts, steps } = self.driven.replace(Driven::default()).unwrap_or_default();
        volts.map(|sum| sum / f64::from(steps.max(1)))
    }

    /// Brings the joints to where a world has them, in rad and rad/s, and shows the accelerometer what it has
    /// to feel, in multiples of the acceleration of gravity.
    pub(crate) fn put(&mut self, angles: [f64; 3], speeds: [f64; 3], acceleration: [f64; 3]) {
        for ((joint, angle), speed) in self.joints.iter_mut().zip(angles).zip(speeds) {
            joint.put(angle, speed);
        }
        self.acceleration = acceleration;
    }

    /// What the accelerometer reads along x, y and z of the half with the Front dock, in multiples of the
    /// acceleration of gravity.
    pub fn acceleration(&self) -> [f64; 3] {
        self.acceleration
    }

    /// The docks that send out light, to look for others.
    pub(crate) fn looking(&self, mcus: &[Mcu; 2]) -> DockSet {
        let lit = DOCKS.into_iter().filter(|(controller, _)| is_high(&mcus[*controller as usize], PORTB, 0));
        let mut docks = DockSet::EMPTY;
        lit.flat_map(|(_, docks)| docks).for_each(|dock| docks.insert(dock));
        docks
    }

    /// Sets what a dock sees of the others of the robot, in counts of the converter.
    pub(crate) fn reflect(&mut self, dock: Dock, counts: u16) {
        self.reflected[usize::from(dock.index())] = counts;
    }

    /// Whether a latch has come to an end by its own motor since they were last taken.
    pub(crate) fn has_arrived(&self) -> bool {
        !self.arrivals.is_empty()
    }

    /// Takes the latches that have come to an end by their own motors since the last call.
    pub(crate) fn take_arrivals(&mut self) -> Vec<(Dock, End)> {
        std::mem::take(&mut self.arrivals)
    }

    /// Another motor than its own, or whoever built the robot, has moved a latch.
    pub(crate) fn set_latch(&mut self, dock: Dock, end: End) {
        *self.latch_mut(dock) = Latch::at(if end == End::Latched { 1.0 } else { 0.0 });
    }

    /// Wires the body to MCUs at power-up.
    pub(crate) fn attach(&mut self, mcus: &mut [Mcu; 2]) {
        for mcu in &mut *mcus {
            mcu.set_analog(|analog| analog.multiplexer = Some(MULTIPLEXER));
            mcu.make_plain(&FOLLOWED);
        }
        self.show(mcus);
    }

    /// Lets a [`STEP`] pass as the pins are, and then shows the MCUs where that has led.
    pub(crate) fn step(&mut self, mcus: &mut [Mcu; 2]) {
        let volts = self.battery.volts();
        let mut amperes = IDLE_AMPERES;
        for wiring in &JOINTS {
            let joint = &mut self.joints[usize::from(wiring.axis.index())];
            let duty = duty(&mcus[wiring.controller as usize], wiring);
            joint.surroundings.supply_volts = volts;
            match &mut self.driven {
                None => (0..PARTS).for_each(|_| joint.step(duty, SECONDS / f64::from(PARTS))),
                Some(driven) => {
                    joint.drive(duty);
                    driven.volts[usize::from(wiring.axis.index())] += joint.volts(duty);
                }
            }
            amperes += joint.amperes() * duty.abs();
        }
        if let Some(driven) = &mut self.driven {
            driven.steps += 1;
        }
        let is_charging = is_high(&mcus[Controller::Slave as usize], PORTD, 7);
        for (controller, docks) in DOCKS {
            let mcu = &mcus[controller as usize];
            for (place, dock) in (0..).zip(docks) {
                let index = usize::from(dock.index());
                let is_driven = |bit| i8::from(is_high(mcu, PORTC, bit));
                let direction = is_driven(3 + 2 * place) - is_driven(2 + 2 * place);
                let latch = &mut self.latches[index];
                let before = (direction != 0).then(|| end_of(latch));
                latch.step(direction, SECONDS);
                amperes += latch.amperes();
                if before.is_some_and(|before| end_of(latch) != before) {
                    self.arrivals.extend(end_of(latch).map(|end| (dock, end)));
                }
                if is_high(mcu, PORTD, 4 + place) {
                    let outward = self.dock_amperes[index];
                    amperes += if is_charging { outward } else { outward.max(0.0) };
                }
            }
        }
        self.battery.step(amperes, SECONDS);
        self.show(mcus);
    }

    /// Sets the voltages and pins that the MCUs see.
    pub(crate) fn show(&mut self, mcus: &mut [Mcu; 2]) {
        for wiring in &JOINTS {
            let joint = &self.joints[usize::from(wiring.axis.index())];
            mcus[wiring.controller as usize].set_analog(|analog| {
                analog.pins[wiring.potentiometer] = joint.potentiometer_volts();
                analog.pins[wiring.current] = joint.current_volts();
            });
        }
        for (controller, docks) in DOCKS {
            let mcu = &mut mcus[controller as usize];
            let indices = docks.map(|dock| usize::from(dock.index()));
            for (place, index) in indices.into_iter().enumerate() {
                let bit = place as u8;
                let is_closed = is_high(mcu, PORTD, 4 + bit);
                let amperes = if is_closed { self.dock_amperes[index] } else { 0.0 };
                mcu.set_analog(|analog| {
                    analog.pins[4 + place] = 2.5 + 0.5 * amperes;
                    let reflected = self.proximity[index].max(self.reflected[index]);
                    analog.multiplexed[place] = (f64::from(reflected) + 0.5) / 1024.0 * 5.0;
                });
                let latch = &self.latches[index];
                let pressed = [latch.is_released(), latch.is_latched()];
                for ((end, is_pressed), shown) in (0..).zip(pressed).zip(&mut self.switches[index]) {
                    if shown.replace(is_pressed) != Some(is_pressed) {
                        // Pressed, a switch pulls its pin low.
                        mcu.drive_pin(Pin { port: 'A', bit: 2 * bit + end }, !is_pressed);
                    }
                }
            }
            let latching: f64 = indices.iter().map(|&index| self.latches[index].amperes()).sum();
            let celsius = self.celsius[controller as usize];
            let rest = match controller {
                Controller::Master => self.acceleration.map(|axis| 2.5 + 0.8 * axis),
                Controller::Slave => [self.battery.volts() / 2.0, 0.5 + 0.01 * self.battery.celsius, 0.0],
            };
            mcu.set_analog(|analog| {
                analog.multiplexed[3] = latching;
                analog.multiplexed[4] = 0.5 + 0.01 * celsius;
                analog.multiplexed[5..].copy_from_slice(&rest);
            });
        }
    }
}

/// The end at which a latch presses its switch.
fn end_of(latch: &Latch) -> Option<End> {
    match (latch.is_released(), latch.is_latched()) {
        (true, _) => Some(End::Released),
        (_, true) => Some(End::Latched),
        _ => None,
    }
}

/// Whether an output of this port is high; inputs of these ports have no pull-ups.
fn is_high(mcu: &Mcu, port: u16, bit: u8) -> bool {
    mcu.read(port).is_some_and(|levels| levels & 1 << bit != 0)
}

/// The duty of a joint's motor, -1 to 1.
fn duty(mcu: &Mcu, wiring: &JointWiring) -> f64 {
    let byte = |address| mcu.read(address).unwrap_or(0);
    let word = |address| f64::from(u16::from_le_bytes([byte(address), byte(address + 1)]));
    if byte(TCCR1A) & wiring.connected == 0 {
        return 0.0;
    }
    let duty = word(wiring.compare) / word(ICR1).max(1.0);
    if is_high(mcu, PORTC, wiring.direction) { duty } else { -duty }
}
