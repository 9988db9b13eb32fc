//! The registers, vectors and pins of the timers.

use super::{Pin, Port};

#[derive(Debug)]
pub(crate) struct TimerRegisters {
    /// simavr's name of the timer.
    pub name: char,
    pub control: Control,
    /// TCNTn, or its low byte. The high byte of a register of 16 bits follows the low one.
    pub counter: u16,
    /// A first.
    pub compare: &'static [Compare],
    pub overflow: u8,
    pub capture: Option<Capture>,
    /// The bits of the prescaler that each value of CSn takes; `None` for no clock of the MCU's.
    pub prescaler: [Option<u32>; 8],
    /// Tn, which is the clock for the two highest values of CSn.
    pub clock_pin: Option<Pin>,
    /// The prescaler runs from power-up on. Otherwise it begins when a clock is chosen.
    pub prescaler_runs_on: bool,
    /// A value written without PWM does not go to the buffers that PWM loads.
    pub keeps_buffers: bool,
}

/// TCCRn.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Control {
    /// Of a timer of 8 bits, and the register and bit that choose the crystal at TOSC as its clock.
    Narrow { tccr: u16, crystal: Option<(u16, u8)> },
    /// Of a timer of 16 bits: TCCRnA, TCCRnB and TCCRnC.
    Wide { a: u16, b: u16, c: u16 },
}

#[derive(Debug)]
pub(crate) struct Compare {
    pub register: u16,
    /// Its pin: the port, and the bit.
    pub port: Port,
    pub bit: u8,
    pub vector: u8,
}

#[derive(Debug)]
pub(crate) struct Capture {
    pub register: u16,
    pub pin: Pin,
    pub vector: u8,
}

/// CSn of every timer but Timer0.
const PRESCALER: [Option<u32>; 8] = [None, Some(0), Some(3), Some(6), Some(8), Some(10), None, None];

const fn pin(port: char, bit: u8) -> Pin {
    Pin { port, bit }
}

const fn compare(register: u16, port: Port, bit: u8, vector: u8) -> Compare {
    Compare { register, port, bit, vector }
}

/// The ports that have pins of compare units.
const PORT_B: Port = Port { name: 'B', pins: 0x36 };
const PORT_E: Port = Port { name: 'E', pins: 0x21 };

/// AS0 in ASSR.
const CRYSTAL: (u16, u8) = (0x50, 0x08);

pub(crate) const ATMEGA128: &[TimerRegisters] = &[
    TimerRegisters {
        name: '0',
        control: Control::Narrow { tccr: 0x53, crystal: Some(CRYSTAL) },
        counter: 0x52,
        compare: &[compare(0x51, PORT_B, 4, 15)],
        overflow: 16,
        capture: None,
        prescaler: [None, Some(0), Some(3), Some(5), Some(6), Some(7), Some(8), Some(10)],
        clock_pin: None,
        prescaler_runs_on: false,
        keeps_buffers: false,
    },
    TimerRegisters {
        name: '1',
        control: Control::Wide { a: 0x4f, b: 0x4e, c: 0x7a },
        counter: 0x4c,
        compare: &[compare(0x4a, PORT_B, 5, 12), compare(0x48, PORT_B, 6, 13), compare(0x78, PORT_B, 7, 24)],
        overflow: 14,
        capture: Some(Capture { register: 0x46, pin: pin('D', 4), vector: 11 }),
        prescaler: PRESCALER,
        clock_pin: Some(pin('D', 6)),
        prescaler_runs_on: false,
        keeps_buffers: false,
    },
    TimerRegisters {
        name: '2',
        control: Control::Narrow { tccr: 0x45, crystal: None },
        counter: 0x44,
        compare: &[compare(0x43, PORT_B, 7, 9)],
        overflow: 10,
        capture: None,
        prescaler: PRESCALER,
        clock_pin: Some(pin('D', 7)),
        prescaler_runs_on: false,
        keeps_buffers: false,
    },
    TimerRegisters {
        name: '3',
        control: Control::Wide { a: 0x8b, b: 0x8a, c: 0x8c },
        counter: 0x88,
        compare: &[compare(0x86, PORT_E, 3, 26), compare(0x84, PORT_E, 4, 27), compare(0x82, PORT_E, 5, 28)],
        overflow: 29,
        capture: Some(Capture { register: 0x80, pin: pin('E', 7), vector: 25 }),
        prescaler: PRESCALER,
        clock_pin: Some(pin('E', 6)),
        prescaler_runs_on: true,
        keeps_buffers: true,
    },
];

impl TimerRegisters {
    pub fn is_wide(&self) -> bool {
        matches!(self.control, Control::Wide { .. })
    }

    /// The last value of the counter.
    pub fn max(&self) -> u16 {
        if self.is_wide() { u16::MAX } else { u8::MAX.into() }
    }

    /// All data addresses at which the program writes to the timer.
    pub fn all(&self) -> Vec<u16> {
        let mut all = match self.control {
            Control::Narrow { tccr, .. } => vec![tccr],
            Control::Wide { a, b, c } => vec![a, b, c],
        };
        let words = self.compare.iter().map(|unit| unit.register);
        let words = words.chain(self.capture.as_ref().map(|unit| unit.register)).chain([self.counter]);
        all.extend(words.flat_map(|low| low..=low + u16::from(self.is_wide())));
        all
    }

    /// The addresses whose reads the timer answers: a read of the low byte keeps the high one.
    pub fn read(&self) -> Vec<u16> {
        let words = self.capture.as_ref().map(|unit| unit.register).into_iter().chain([self.counter]);
        words.flat_map(|low| low..=low + u16::from(self.is_wide())).collect()
    }
}
