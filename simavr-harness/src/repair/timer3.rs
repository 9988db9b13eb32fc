//! Timer3 (chapter "16-bit Timer/Counter"), in place of simavr's. simavr's misses a match that lies
//! within an instruction of the counter's overflow, and its fast PWM has no double-buffered registers.
//!
//! Simplified: in a mode that counts down, or with a clock at pin T3, the counter stands still; the prescaler
//! runs from power-up on, whatever SFIOR says.

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device, make_plain};

const ICR3L: u16 = 0x80;
const ICR3H: u16 = 0x81;
const OCR3CL: u16 = 0x82;
const OCR3BL: u16 = 0x84;
const OCR3AL: u16 = 0x86;
const TCNT3L: u16 = 0x88;
const TCNT3H: u16 = 0x89;
const TCCR3B: u16 = 0x8a;
const TCCR3A: u16 = 0x8b;
const TCCR3C: u16 = 0x8c;

/// Pins of port E: the capture unit's, and those of the compare units A, B and C.
const CAPTURE_PIN: u8 = 7;
const COMPARE_PINS: [u8; 3] = [3, 4, 5];

// TCCR3B
const RISING: u8 = 0x40;
const CLOCK: u8 = 0x07;

/// The action of a compare unit on its pin (COM3x).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Output {
    Port,
    Toggle,
    Clear,
    Set,
}

/// What the counter counts up to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Top {
    Fixed(u16),
    Ocr3a,
    Icr3,
}

/// A mode that counts up (table "Waveform Generation Mode Bit Description").
#[derive(Clone, Copy)]
struct Mode {
    top: Top,
    is_pwm: bool,
}

impl Mode {
    const NORMAL: Self = Self { top: Top::Fixed(u16::MAX), is_pwm: false };

    /// `None`: the mode of this number counts down, too.
    fn of_number(number: u8) -> Option<Self> {
        let fast_pwm = |top| Some(Self { top, is_pwm: true });
        match number {
            0 => Some(Self::NORMAL),
            4 => Some(Self { top: Top::Ocr3a, is_pwm: false }),
            5 => fast_pwm(Top::Fixed(0xff)),
            6 => fast_pwm(Top::Fixed(0x1ff)),
            7 => fast_pwm(Top::Fixed(0x3ff)),
            12 => Some(Self { top: Top::Icr3, is_pwm: false }),
            14 => fast_pwm(Top::Icr3),
            15 => fast_pwm(Top::Ocr3a),
            _ => None,
        }
    }
}

/// How many bits of the prescaler a clock of the timer takes; `None` for no clock of the MCU's.
fn prescaler_bits(control: u8) -> Option<u32> {
    match control & CLOCK {
        1 => Some(0),
        2 => Some(3),
        3 => Some(6),
        4 => Some(8),
        5 => Some(10),
        _ => None,
    }
}

pub(crate) struct Timer3 {
    capture: Vector,
    /// The vectors of units A, B and C.
    compare: [Vector; 3],
    overflow: Vector,
    /// The cycle at which the counter was 0. `None` while it stands still, at `stands_at`.
    zero_at: Option<u64>,
    stands_at: u16,
    /// A clock of the timer takes 2 to the power of this in cycles.
    clock_bits: u32,
    mode: Option<Mode>,
    icr: u16,
    /// OCR3A, OCR3B, OCR3C as they are compared, and the buffers from which they are loaded in PWM mode.
    compared: [u16; 3],
    buffered: [u16; 3],
    /// The high byte on its way to or from a 16-bit register.
    high: u8,
    /// The cycle up to which matches and overflows have been processed.
    done: u64,
    /// The cycle at which no unit matches, as the program has set the counter just before.
    blocked_at: u64,
    capture_level: bool,
}

/// Replaces simavr's timer by the harness's. Its vectors are consecutive, from `capture` on. `None`: the part
/// has no such vectors.
pub(crate) fn attach(cpu: Cpu, capture: u8) -> Option<Attached<Timer3>> {
    let timer = Timer3 {
        capture: cpu.vector(capture)?,
        compare: [cpu.vector(capture + 1)?, cpu.vector(capture + 2)?, cpu.vector(capture + 3)?],
        overflow: cpu.vector(capture + 4)?,
        zero_at: None,
        stands_at: 0,
        clock_bits: 0,
        mode: Some(Mode::NORMAL),
        icr: 0,
        compared: [0; 3],
        buffered: [0; 3],
        high: 0,
        done: 0,
        blocked_at: 0,
        capture_level: false,
    };
    let registers: Vec<u16> = (ICR3L..=TCCR3C).collect();
    make_plain(cpu, &registers);
    let attached = Attached::new(cpu, timer, &registers, &[TCNT3L, TCNT3H, ICR3L, ICR3H]);
    attached.watch_pin(cpu, 'E', CAPTURE_PIN);
    Some(attached)
}

impl Timer3 {
    /// Sets the registers to their values after a reset.
    pub fn reset(&mut self, cpu: Cpu) {
        cpu.disconnect_capture('3', 'E', CAPTURE_PIN);
        self.zero_at = None;
        self.stands_at = 0;
        self.mode = Some(Mode::NORMAL);
        self.icr = 0;
        self.compared = [0; 3];
        self.buffered = [0; 3];
        self.done = cpu.cycle();
    }

    fn top(&self) -> u16 {
        match self.mode.unwrap_or(Mode::NORMAL).top {
            Top::Fixed(top) => top,
            Top::Ocr3a => self.compared[0],
            Top::Icr3 => self.icr,
        }
    }

    fn counts_to_icr(&self) -> bool {
        self.mode.is_some_and(|mode| mode.top == Top::Icr3)
    }

    fn is_pwm(&self) -> bool {
        self.mode.is_some_and(|mode| mode.is_pwm)
    }

    fn counter(&self, now: u64) -> u16 {
        self.zero_at.map_or(self.stands_at, |zero_at| (now.wrapping_sub(zero_at) >> self.clock_bits) as u16)
    }

    /// Sets the counter.
    fn count_from(&mut self, cpu: Cpu, value: u16) {
        let bits = self.mode.and_then(|_| prescaler_bits(cpu.data(TCCR3B)));
        self.clock_bits = bits.unwrap_or(0);
        self.stands_at = value;
        self.zero_at = bits.map(|bits| (cpu.cycle() >> bits).wrapping_sub(value.into()) << bits);
        self.done = cpu.cycle();
    }

    /// The last value of the counter's present round: one beyond its top counts on to 0xFFFF.
    fn last(&self) -> u16 {
        let top = self.top();
        if self.counter(self.done) > top { u16::MAX } else { top }
    }

    /// The cycle at which the counter leaves `value` in its present round; `None` while it stands still.
    fn leaves(&self, value: u16) -> Option<u64> {
        self.zero_at.map(|zero_at| zero_at.wrapping_add((u64::from(value) + 1) << self.clock_bits))
    }

    fn output(cpu: Cpu, unit: usize) -> Output {
        match cpu.data(TCCR3A) >> (6 - 2 * unit) & 3 {
            0 => Output::Port,
            1 => Output::Toggle,
            2 => Output::Clear,
            _ => Output::Set,
        }
    }

    /// Changes the pin of a unit at a match, or at a forced one.
    fn change_pin(cpu: Cpu, unit: usize) {
        let pin = COMPARE_PINS[unit];
        match Self::output(cpu, unit) {
            Output::Port => {}
            Output::Toggle => cpu.output_pin('E', pin, cpu.pins('E') & 1 << pin == 0),
            Output::Clear => cpu.output_pin('E', pin, false),
            Output::Set => cpu.output_pin('E', pin, true),
        }
    }

    /// The counter goes from `last` to 0.
    fn begin_round(&mut self, cpu: Cpu, last: u16, now: u64) {
        self.zero_at = Some(now);
        let is_top = last == self.top();
        if is_top && self.counts_to_icr() {
            cpu.raise(self.capture);
        }
        let overflows = if self.is_pwm() { is_top } else { last == u16::MAX };
        if overflows {
            cpu.raise(self.overflow);
        }
        if !is_top || !self.is_pwm() {
            return;
        }
        self.compared = self.buffered;
        for (unit, pin) in COMPARE_PINS.into_iter().enumerate() {
            match Self::output(cpu, unit) {
                Output::Port | Output::Toggle => {}
                Output::Clear => cpu.output_pin('E', pin, true),
                Output::Set => cpu.output_pin('E', pin, false),
            }
        }
    }

    fn set_icr(&mut self, cpu: Cpu, value: u16) {
        self.icr = value;
        let [low, high] = value.to_le_bytes();
        cpu.set_data(ICR3L, low);
        cpu.set_data(ICR3H, high);
    }

    /// Without PWM the program "will access the OCR3x directly". This is read to mean that the buffer keeps
    /// its value.
    fn write_compare(&mut self, cpu: Cpu, unit: usize, value: u16) {
        if self.is_pwm() {
            self.buffered[unit] = value;
        } else {
            self.compared[unit] = value;
            self.done = cpu.cycle(); // a value that the counter has passed is no match
        }
    }
}

impl Device for Timer3 {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        // Matches and overflows that are due come before the write.
        while let Some(due) = self.due().filter(|&due| due <= cpu.cycle()) {
            self.expire(cpu, due);
        }
        let word = u16::from_le_bytes([value, self.high]);
        match address {
            TCCR3A | TCCR3B => {
                let counter = self.counter(cpu.cycle());
                cpu.set_data(address, value);
                self.mode = Mode::of_number(cpu.data(TCCR3B) >> 1 & 0b1100 | cpu.data(TCCR3A) & 0b11);
                self.count_from(cpu, counter);
            }
            TCCR3C => {
                // FOC3A, FOC3B and FOC3C in bits 7 to 5 are strobes, and work only in a mode without PWM.
                for unit in 0..3 {
                    if self.mode.is_some() && !self.is_pwm() && value & 0x80 >> unit != 0 {
                        Self::change_pin(cpu, unit);
                    }
                }
            }
            TCNT3L => {
                self.count_from(cpu, word);
                self.blocked_at = ((cpu.cycle() >> self.clock_bits) + 1) << self.clock_bits;
            }
            OCR3CL | OCR3BL | OCR3AL => {
                self.write_compare(cpu, usize::from((OCR3AL - address) / 2), word);
                cpu.set_data(address, value);
                cpu.set_data(address + 1, self.high);
            }
            // Only in a mode that counts up to it.
            ICR3L if self.counts_to_icr() => {
                self.set_icr(cpu, word);
                self.done = cpu.cycle(); // a value that the counter has passed is no top
            }
            ICR3L => {}
            _ => self.high = value,
        }
    }

    fn read(&mut self, cpu: Cpu, address: u16) -> u8 {
        match address {
            TCNT3L => {
                let [low, high] = self.counter(cpu.cycle()).to_le_bytes();
                self.high = high;
                low
            }
            ICR3L => {
                self.high = cpu.data(ICR3H);
                cpu.data(ICR3L)
            }
            _ => self.high,
        }
    }

    fn due(&self) -> Option<u64> {
        let last = self.last();
        let matches = self.compared.iter().filter(|&&value| value <= last);
        let matches = matches.filter_map(|&value| self.leaves(value)).filter(|&due| due != self.blocked_at);
        matches.chain(self.leaves(last)).filter(|&due| due > self.done).min()
    }

    fn expire(&mut self, cpu: Cpu, now: u64) {
        let last = self.last();
        self.done = now;
        for unit in 0..3 {
            let value = self.compared[unit];
            if value <= last && self.leaves(value) == Some(now) && now != self.blocked_at {
                cpu.raise(self.compare[unit]);
                Self::change_pin(cpu, unit);
            }
        }
        if self.leaves(last) == Some(now) {
            self.begin_round(cpu, last, now);
        }
    }

    fn pin_changed(&mut self, cpu: Cpu, is_high: bool) {
        if is_high == std::mem::replace(&mut self.capture_level, is_high) {
            return;
        }
        let is_wanted = (cpu.data(TCCR3B) & RISING != 0) == is_high;
        if is_wanted && self.mode.is_some() && !self.counts_to_icr() {
            self.set_icr(cpu, self.counter(cpu.cycle()));
            cpu.raise(self.capture);
        }
    }
}
