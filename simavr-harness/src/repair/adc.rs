//! The converter (chapter "Analog-to-Digital Converter"), in place of simavr's. A conversion takes its time,
//! the first one longer, and begins at an edge of the converter's own clock.
//!
//! A pin may carry the output of an analog multiplexer, addressed by three pins of the MCU.
//!
//! Simplified: the voltage is sampled as the conversion begins, not 1.5 clocks later; a differential input
//! settles at once; the first conversion with another reference, which may be wrong on the chip, reads half.

use simulation::Noise;

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device, make_plain};
use crate::part::{AdcRegisters, Pin};
use crate::repair::interrupt;

/// Clocks of a conversion (table "ADC Conversion Time").
const CLOCKS: u64 = 13;

/// Clocks of the first conversion after the converter was switched on.
const FIRST_CLOCKS: u64 = 25;

/// AVCC and AREF, in V.
const SUPPLY: f64 = 5.0;
const INTERNAL: f64 = 2.56;
const BANDGAP: f64 = 1.23;

/// Single-ended inputs.
const CHANNELS: usize = 8;

// ADCSRA
const ADEN: u8 = 0x80;
const ADSC: u8 = 0x40;
const ADFR: u8 = 0x20;
const ADIF: u8 = 0x10;
const ADPS: u8 = 0x07;
// ADMUX
const REFS: u8 = 0xc0;
const REFS_INTERNAL: u8 = 0xc0;
const ADLAR: u8 = 0x20;
const MUX: u8 = 0x1f;
const MUX_BANDGAP: u8 = 0x1e;

/// The positive and the negative pin of a differential input, and its gain (table "Input Channel and Gain
/// Selections").
fn differential(mux: u8) -> Option<(usize, usize, f64)> {
    let mux = usize::from(mux);
    match mux {
        8..16 => {
            let negative = if mux < 12 { 0 } else { 2 };
            Some((negative + mux % 2, negative, if mux & 2 == 0 { 10.0 } else { 200.0 }))
        }
        16..24 => Some((mux - 16, 1, 1.0)),
        24..30 => Some((mux - 24, 2, 1.0)),
        _ => None,
    }
}

/// An analog multiplexer before a pin.
#[derive(Clone, Copy, Debug)]
pub struct Multiplexer {
    /// The analog pin, 0 to 7.
    pub pin: usize,
    /// The pins of its address, from the lowest bit.
    pub address: [Pin; 3],
}

/// The voltages at the analog inputs.
#[derive(Clone, Debug, Default)]
pub struct Analog {
    /// At the pins, in V.
    pub pins: [f64; CHANNELS],
    pub multiplexer: Option<Multiplexer>,
    /// At the multiplexer's inputs, in V.
    pub multiplexed: [f64; 8],
    /// In shares of the reference.
    pub noise: Noise,
}

pub(crate) struct Adc {
    registers: &'static AdcRegisters,
    complete: Vector,
    pub analog: Analog,
    /// The cycle at which the converter was switched on, from which its clock runs.
    on_since: Option<u64>,
    has_converted: bool,
    /// REFS of the last conversion; `None` before the first one after a reset.
    reference: Option<u8>,
    conversion: Option<Conversion>,
    /// The last result that was stored.
    result: u16,
    /// ADCL was read and ADCH not yet: no new result is stored.
    is_locked: bool,
}

struct Conversion {
    result: u16,
    ends: u64,
}

/// Replaces simavr's converter by the harness's. `None`: the part has no such vector.
pub(crate) fn attach(cpu: Cpu, registers: &'static AdcRegisters) -> Option<Attached<Adc>> {
    let &AdcRegisters { adcl, adch, adcsra, admux, .. } = registers;
    let adc = Adc {
        registers,
        complete: cpu.vector(registers.complete)?,
        analog: Analog::default(),
        on_since: None,
        has_converted: false,
        reference: None,
        conversion: None,
        result: 0,
        is_locked: false,
    };
    make_plain(cpu, &[adcl, adch, adcsra, admux]);
    Some(Attached::new(cpu, adc, &[adcsra, admux], &[adcl, adch]))
}

impl Adc {
    /// Sets the registers to their values after a reset. The inputs keep their voltages.
    pub fn reset(&mut self, cpu: Cpu) {
        self.switch_off();
        self.reference = None;
        self.result = 0;
        self.is_locked = false;
        let &AdcRegisters { adcl, adch, adcsra, admux, .. } = self.registers;
        for address in [adcl, adch, adcsra, admux] {
            cpu.set_data(address, 0);
        }
        interrupt::refresh(cpu, self.complete);
    }

    /// The core goes to sleep. If the converter is on and idle, a conversion begins (chapter "Power
    /// Management and Sleep Modes", "Idle Mode").
    pub fn sleeps(&mut self, cpu: Cpu) {
        if self.on_since.is_some() && self.conversion.is_none() {
            self.begin(cpu, cpu.cycle());
            self.show_whether_converting(cpu);
        }
    }

    fn switch_off(&mut self) {
        self.on_since = None;
        self.has_converted = false;
        self.conversion = None;
    }

    /// Begins a conversion at the next edge of the converter's clock.
    fn begin(&mut self, cpu: Cpu, now: u64) {
        let Some(on_since) = self.on_since else { return };
        let clock = match cpu.data(self.registers.adcsra) & ADPS {
            0 => 2,
            shift => 1 << shift,
        };
        let clocks = if self.has_converted { CLOCKS } else { FIRST_CLOCKS };
        self.has_converted = true;
        let begins = on_since + (now - on_since).next_multiple_of(clock);
        let reference = cpu.data(self.registers.admux) & REFS;
        let is_settled = self.reference.replace(reference) == Some(reference);
        let converted = self.convert(cpu);
        let result = if is_settled { converted } else { converted / 2 } as u16 & 0x3ff;
        self.conversion = Some(Conversion { result, ends: begins + clocks * clock });
    }

    /// The voltage at the chosen input, in 1/1024 of the reference, or at a differential one in 1/512,
    /// rounded down.
    fn convert(&mut self, cpu: Cpu) -> i16 {
        let admux = cpu.data(self.registers.admux);
        let reference = if admux & REFS == REFS_INTERNAL { INTERNAL } else { SUPPLY };
        let mux = admux & MUX;
        let noise = self.analog.noise.draw();
        if let Some((positive, negative, gain)) = differential(mux) {
            let volts = gain * (self.voltage(cpu, positive) - self.voltage(cpu, negative));
            return ((volts / reference + noise) * 512.0).floor().clamp(-512.0, 511.0) as i16;
        }
        let volts = if mux == MUX_BANDGAP { BANDGAP } else { self.voltage(cpu, mux.into()) };
        ((volts / reference + noise) * 1024.0).clamp(0.0, 1023.0) as i16
    }

    /// The voltage at a pin; at that of the multiplexer, the voltage of the addressed input.
    fn voltage(&self, cpu: Cpu, pin: usize) -> f64 {
        match self.analog.multiplexer {
            Some(Multiplexer { pin: joined, address }) if joined == pin => {
                let number =
                    (0..).zip(address).map(|(bit, pin)| usize::from(cpu.is_high(pin)) << bit).sum::<usize>();
                self.analog.multiplexed[number]
            }
            _ => self.analog.pins.get(pin).copied().unwrap_or(0.0),
        }
    }

    fn write_control(&mut self, cpu: Cpu, value: u8) {
        let now = cpu.cycle();
        if value & ADEN == 0 {
            self.switch_off();
        } else {
            self.on_since = self.on_since.or(Some(now));
        }
        let flag = cpu.data(self.registers.adcsra) & ADIF & !value;
        cpu.set_data(self.registers.adcsra, value & !(ADIF | ADSC) | flag);
        if value & ADSC != 0 && self.conversion.is_none() {
            self.begin(cpu, now);
        }
        self.show_whether_converting(cpu);
    }

    /// Shows the last result. A change of ADLAR moves it at once.
    fn show_result(&self, cpu: Cpu) {
        let is_left_adjusted = cpu.data(self.registers.admux) & ADLAR != 0;
        let [low, high] = (self.result << if is_left_adjusted { 6 } else { 0 }).to_le_bytes();
        cpu.set_data(self.registers.adcl, low);
        cpu.set_data(self.registers.adch, high);
    }

    fn show_whether_converting(&self, cpu: Cpu) {
        cpu.set_bits(self.registers.adcsra, ADSC, self.conversion.is_some());
    }
}

impl Device for Adc {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        if address == self.registers.admux {
            cpu.set_data(address, value);
            self.show_result(cpu);
        } else {
            self.write_control(cpu, value);
            interrupt::refresh(cpu, self.complete);
        }
    }

    fn read(&mut self, cpu: Cpu, address: u16) -> u8 {
        self.is_locked = address == self.registers.adcl;
        cpu.data(address)
    }

    fn due(&self) -> Option<u64> {
        self.conversion.as_ref().map(|conversion| conversion.ends)
    }

    fn expire(&mut self, cpu: Cpu, now: u64) {
        let Some(conversion) = self.conversion.take() else { return };
        if !self.is_locked {
            self.result = conversion.result;
            self.show_result(cpu);
        }
        cpu.set_bits(self.registers.adcsra, ADIF, true);
        if cpu.data(self.registers.adcsra) & ADFR != 0 {
            self.begin(cpu, now);
        }
        self.show_whether_converting(cpu);
        interrupt::refresh(cpu, self.complete);
    }
}
