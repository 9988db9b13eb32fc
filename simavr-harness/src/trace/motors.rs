//! Computes the levels of the pins that drive an MCU's joints from the registers of Timer1 and port C.
//!
//! simavr does not simulate these registers, because the body follows them. So the pulses are computed as the
//! timer makes them in the phase and frequency correct mode, in which it counts up to ICR1 and down again
//! with the MCU's clock (datasheet, "16-bit Timer/Counter", "Phase and Frequency Correct PWM Mode"). A pin is
//! high while the counter is below the compare register, whose value is taken over at the bottom.

use crate::Controller;
use crate::joint_pins::{ICR1, JOINTS, JointWiring, PORTC, TCCR1A, TCCR1B};
use crate::trace::{Line, RegisterWrite, Trace};

/// The clock select bits of TCCR1B. Any of them set: the timer has a clock.
const CLOCKED: u8 = 7;

/// The pins of an MCU's joints: for each joint its pulses and its direction.
pub fn motor_lines(trace: &Trace, controller: Controller) -> Vec<Line> {
    let joints = JOINTS.iter().filter(|joint| joint.controller == controller);
    joints.flat_map(|joint| [pulses(joint, trace), direction(joint, &trace.registers)]).collect()
}

fn direction(joint: &JointWiring, writes: &[RegisterWrite]) -> Line {
    let ports = writes.iter().filter(|write| write.address == PORTC);
    let levels = ports.map(|write| (write.cycle, write.value & 1 << joint.direction != 0));
    Line::of_levels(format!("{:?}_direction", joint.axis), false, levels)
}

/// The timer between two writes to its registers.
#[derive(Default)]
struct Timer {
    is_connected: bool,
    is_clocked: bool,
    top: u16,
    compare: u16,
    /// The cycle at which the counter is next at its bottom.
    bottom: u64,
    highs: Vec<(u64, u64)>,
}

fn pulses(joint: &JointWiring, trace: &Trace) -> Line {
    let mut timer = Timer::default();
    let mut high_bytes = [0; 2];
    for &RegisterWrite { cycle, address, value } in &trace.registers {
        timer.run_until(cycle);
        let word = |high: u8| u16::from_le_bytes([value, high]);
        match address {
            TCCR1A => timer.is_connected = value & joint.connected != 0,
            TCCR1B => {
                let is_clocked = value & CLOCKED != 0;
                if is_clocked && !timer.is_clocked {
                    timer.bottom = cycle;
                }
                timer.is_clocked = is_clocked;
            }
            ICR1 => timer.top = word(high_bytes[0]),
            _ if address == ICR1 + 1 => high_bytes[0] = value,
            // The low byte is written last.
            _ if address == joint.compare => timer.compare = word(high_bytes[1]),
            _ if address == joint.compare + 1 => high_bytes[1] = value,
            _ => {}
        }
    }
    timer.run_until(trace.end);
    let highs = timer.highs.into_iter().map(|(begin, end)| (begin, end.min(trace.end)));
    Line::of(format!("{:?}_pwm", joint.axis), false, highs.collect())
}

impl Timer {
    /// Adds the pulses of all periods that begin before `cycle`.
    fn run_until(&mut self, cycle: u64) {
        if !self.is_clocked || self.top == 0 {
            return;
        }
        let period = 2 * u64::from(self.top);
        while self.bottom < cycle {
            let (duty, next) = (u64::from(self.compare.min(self.top)), self.bottom + period);
            if self.is_connected && duty > 0 {
                self.highs.extend([(self.bottom, self.bottom + duty), (next - duty, next)]);
            }
            self.bottom = next;
        }
    }
}
