//! The body of a module, wired to the pins of both MCUs as `board/src/superbot.rs` has it.

use simulation::{Body, CLOCK_HZ, Drives};
use tasks::dock::{Dock, DockSet};
use tasks::docking::latch::EndSwitches;
use tasks::superbot::{MASTER, SLAVE};

use crate::Controller;
use crate::joint_pins::{ICR1, JOINTS, JointWiring, PORTB, PORTC, TCCR1A, TCCR1B};
use crate::mcu::Mcu;
use crate::part::Pin;
use crate::repair::adc::Multiplexer;

/// Cycles of a step in which the body follows the pins: 0.25 ms, four steps to a period of the joints'
/// control. Both MCUs stop for each step.
pub const STEP: u64 = 4000;

/// A step, in s.
const SECONDS: f64 = STEP as f64 / CLOCK_HZ as f64;

/// The multiplexer before ADC7.
const MULTIPLEXER: Multiplexer = Multiplexer {
    pin: 7,
    address: [Pin { port: 'G', bit: 0 }, Pin { port: 'G', bit: 1 }, Pin { port: 'G', bit: 2 }],
};

// Data addresses: reading a register is far cheaper than asking simavr for a pin's level.
const TCNT1H: u16 = 0x4d;
const TCNT1L: u16 = 0x4c;
const PORTD: u16 = 0x32;

/// Registers of Timer1, and port C. Only the body follows these: otherwise the timer would count each pulse
/// of the motors, 20,000 a second, and simavr would signal the level of each pin.
const FOLLOWED: [u16; 5] = [PORTC, TCNT1L, TCNT1H, TCCR1B, TCCR1A];

/// The bits of TIMSK and ETIMSK that enable interrupts of Timer1.
const TIMER1_INTERRUPTS: [(u16, u8); 2] = [(0x57, 0x3c), (0x7d, 0x01)];

/// The docks of each half, by their places.
const DOCKS: [(Controller, [Dock; 3]); 2] =
    [(Controller::Master, MASTER.docks()), (Controller::Slave, SLAVE.docks())];

/// WGM10 and WGM11 in TCCR1A, WGM12 and WGM13 in TCCR1B, and there the bits that choose the clock.
const MODE_A: u8 = 0b11;
const MODE_B: u8 = 0b11 << 3;
const CLOCK: u8 = 0b111;

/// [`MODE_A`] and [`MODE_B`] of PWM up to ICR1: phase and frequency correct, phase correct, and fast.
const PWM_TO_ICR1: [(u8, u8); 3] = [(0, 1 << 4), (1 << 1, 1 << 4), (1 << 1, MODE_B)];

/// The levels last shown for the switches at the ends of the latches, by dock: released, latched.
#[derive(Default)]
pub struct BodyPins {
    switches: [[Option<bool>; 2]; 6],
}

impl BodyPins {
    /// Wires a body to MCUs at power-up.
    pub fn attach(&mut self, body: &Body, mcus: &mut [Mcu; 2]) {
        for mcu in &mut *mcus {
            mcu.set_analog(|analog| analog.multiplexer = Some(MULTIPLEXER));
            mcu.make_plain(&FOLLOWED);
            mcu.refuse_reads(
                &[TCNT1L, TCNT1H],
                "TCNT1 read: on a module Timer1 drives the joints, and does not count",
            );
        }
        self.show(body, mcus);
    }

    /// Moves the body for a [`STEP`] as the pins drive it, and then shows the MCUs its new state.
    pub fn step(&mut self, body: &mut Body, mcus: &mut [Mcu; 2]) {
        for (controller, mcu) in Controller::ALL.into_iter().zip(&mut *mcus) {
            if TIMER1_INTERRUPTS.iter().any(|&(register, mask)| mcu.read(register).unwrap_or(0) & mask != 0) {
                mcu.crash_for(
                    "Timer1 interrupts: on a module it drives the joints, and nothing else is simulated",
                );
            }
            if is_driven_otherwise(mcu, controller) {
                mcu.crash_for(
                    "Timer1 drives a joint otherwise: on a module it is to clear the pin at the match, in \
                     PWM up to ICR1 (WGM13..0 = 8, 10 or 14)",
                );
            }
        }
        body.step(&drives(mcus), SECONDS);
        self.show(body, mcus);
    }

    /// Sets the voltages and pins that the MCUs see.
    pub fn show(&mut self, body: &Body, mcus: &mut [Mcu; 2]) {
        for wiring in &JOINTS {
            let joint = body.joint(wiring.axis);
            mcus[wiring.controller as usize].set_analog(|analog| {
                analog.pins[wiring.potentiometer] = joint.potentiometer_volts();
                analog.pins[wiring.current] = joint.current_volts();
            });
        }
        for (controller, docks) in DOCKS {
            let mcu = &mut mcus[controller as usize];
            for (place, dock) in docks.into_iter().enumerate() {
                let bit = place as u8;
                let is_closed = is_high(mcu, PORTD, 4 + bit);
                let index = usize::from(dock.index());
                let amperes = if is_closed { body.dock_amperes[index] } else { 0.0 };
                mcu.set_analog(|analog| {
                    analog.pins[4 + place] = 2.5 + 0.5 * amperes;
                    analog.multiplexed[place] = body.light_volts(dock);
                });
                let EndSwitches { is_released, is_latched } = body.end_switches(dock);
                let pressed = [is_released, is_latched];
                for ((end, is_pressed), shown) in (0..).zip(pressed).zip(&mut self.switches[index]) {
                    if shown.replace(is_pressed) != Some(is_pressed) {
                        // Pressed, a switch pulls its pin low.
                        mcu.drive_pin(Pin { port: 'A', bit: 2 * bit + end }, !is_pressed);
                    }
                }
            }
            let latching: f64 = docks.into_iter().map(|dock| body.latch(dock).amperes()).sum();
            let celsius = body.celsius[controller as usize];
            let rest = match controller {
                Controller::Master => body.acceleration.map(|axis| 2.5 + 0.8 * axis),
                Controller::Slave => [body.battery.volts() / 2.0, 0.5 + 0.01 * body.battery.celsius, 0.0],
            };
            mcu.set_analog(|analog| {
                analog.multiplexed[3] = latching;
                analog.multiplexed[4] = 0.5 + 0.01 * celsius;
                analog.multiplexed[5..].copy_from_slice(&rest);
            });
        }
    }
}

/// The docks that send out light, to look for others.
pub fn looking(mcus: &[Mcu; 2]) -> DockSet {
    let lit = DOCKS.into_iter().filter(|(controller, _)| is_high(&mcus[*controller as usize], PORTB, 0));
    let mut docks = DockSet::EMPTY;
    lit.flat_map(|(_, docks)| docks).for_each(|dock| docks.insert(dock));
    docks
}

/// The drives of motors and switches, as the pins have them.
fn drives(mcus: &[Mcu; 2]) -> Drives {
    let is_charging = is_high(&mcus[Controller::Slave as usize], PORTD, 7);
    let mut drives = Drives { is_charging, ..Drives::default() };
    for wiring in &JOINTS {
        drives.duties[usize::from(wiring.axis.index())] = duty(&mcus[wiring.controller as usize], wiring);
    }
    for (controller, docks) in DOCKS {
        let mcu = &mcus[controller as usize];
        for (place, dock) in (0..).zip(docks) {
            let is_driven = |bit| i8::from(is_high(mcu, PORTC, bit));
            let direction = is_driven(3 + 2 * place) - is_driven(2 + 2 * place);
            drives.latches[usize::from(dock.index())] = direction;
            if is_high(mcu, PORTD, 4 + place) {
                drives.closed.insert(dock);
            }
        }
    }
    drives
}

/// Whether a pin of this port is driven high, by PORTx and DDRx. A pull-up does not drive: the board's
/// pull-downs are stronger.
fn is_high(mcu: &Mcu, port: u16, bit: u8) -> bool {
    let levels = mcu.read(port).unwrap_or(0);
    is_output(mcu, port, bit) && levels & 1 << bit != 0
}

fn is_output(mcu: &Mcu, port: u16, bit: u8) -> bool {
    mcu.read(port - 1).is_some_and(|outputs| outputs & 1 << bit != 0) // DDRx lies before PORTx
}

/// Whether Timer1 runs, and drives a joint by pulses whose [`duty`] is another one than that.
fn is_driven_otherwise(mcu: &Mcu, controller: Controller) -> bool {
    let [a, b] = [TCCR1A, TCCR1B].map(|address| mcu.read(address).unwrap_or(0));
    let is_other_mode = !PWM_TO_ICR1.contains(&(a & MODE_A, b & MODE_B));
    let has_other_duty = |wiring: &JointWiring| {
        let at_match = a & wiring.output_mode();
        let is_driven = at_match != 0 && is_output(mcu, PORTB, wiring.pin);
        is_driven && (is_other_mode || at_match != wiring.connected)
    };
    let mut joints = JOINTS.iter().filter(|wiring| wiring.controller == controller);
    b & CLOCK != 0 && joints.any(has_other_duty)
}

/// The duty of a joint's motor, -1 to 1.
fn duty(mcu: &Mcu, wiring: &JointWiring) -> f64 {
    let byte = |address| mcu.read(address).unwrap_or(0);
    let word = |address| f64::from(u16::from_le_bytes([byte(address), byte(address + 1)]));
    if byte(TCCR1A) & wiring.connected == 0 || !is_output(mcu, PORTB, wiring.pin) {
        return 0.0;
    }
    let duty = word(wiring.compare) / word(ICR1).max(1.0);
    if is_high(mcu, PORTC, wiring.direction) { duty } else { -duty }
}

#[cfg(test)]
mod tests;
