//! Compares the timers with models of them that count clock by clock, under random programs.

use std::sync::Arc;

use simulation::Random;

use super::mode::{Kind, Mode, Top};
use crate::image::Image;
use crate::mcu::Mcu;
use crate::part::Part;

const TIFR: u16 = 0x56;
const NOP: u16 = 0;

// I/O addresses.
const OCR0: u16 = 0x31;
const TCNT0: u16 = 0x32;
const TCCR0: u16 = 0x33;
const ICR1: u16 = 0x26;
const OCR1B: u16 = 0x28;
const OCR1A: u16 = 0x2a;
const TCNT1: u16 = 0x2c;
const TCCR1B: u16 = 0x2e;
const TCCR1A: u16 = 0x2f;
const OUT_TIFR: u16 = 0x36;

/// A timer that counts clock by clock. `flags` are those of the overflow, of the units and of the capture.
struct Model {
    max: u16,
    mode: Mode,
    divisor: u64,
    phase: u64,
    value: u16,
    goes_down: bool,
    has_turned: bool,
    is_blocked: bool,
    compared: [u16; 2],
    buffered: [u16; 2],
    icr: u16,
    overflow: bool,
    matched: [bool; 2],
    captured: bool,
}

impl Model {
    fn new(max: u16) -> Self {
        Self {
            max,
            mode: Mode::normal(max),
            divisor: 0,
            phase: 0,
            value: 0,
            goes_down: false,
            has_turned: false,
            is_blocked: false,
            compared: [0; 2],
            buffered: [0; 2],
            icr: 0,
            overflow: false,
            matched: [false; 2],
            captured: false,
        }
    }

    fn top(&self) -> u16 {
        match self.mode.top {
            Top::Fixed(top) => top,
            Top::CompareA => self.compared[0],
            Top::Capture => self.icr,
        }
    }

    fn cycle(&mut self) {
        if self.divisor == 0 {
            return;
        }
        self.phase += 1;
        if self.phase == self.divisor {
            self.phase = 0;
            self.clock();
        }
    }

    fn clock(&mut self) {
        for unit in 0..2 {
            self.matched[unit] |= !self.is_blocked && self.value == self.compared[unit];
        }
        self.is_blocked = false;
        let is_top = self.value == self.top();
        if self.goes_down {
            self.value -= 1;
            (self.goes_down, self.has_turned) = (self.value != 0, self.value == 0);
        } else if self.mode.counts_down() && is_top {
            self.captured |= self.mode.top == Top::Capture;
            if self.mode.kind == Kind::PhaseCorrect {
                self.compared = self.buffered;
            }
            self.goes_down = self.value > 1;
            self.has_turned = !self.goes_down;
            self.value = self.value.saturating_sub(1);
        } else {
            if std::mem::take(&mut self.has_turned) {
                self.overflow = true;
                if self.mode.kind == Kind::FrequencyCorrect {
                    self.compared = self.buffered;
                }
            }
            self.count_up(is_top);
        }
    }

    fn count_up(&mut self, is_top: bool) {
        let is_over = is_top || self.value == self.max;
        let is_at_max = self.value == self.max;
        self.value = if is_over { 0 } else { self.value + 1 };
        if self.mode.counts_down() || !is_over {
            return;
        }
        self.captured |= is_top && self.mode.top == Top::Capture;
        self.overflow |= if self.mode.is_pwm() { is_top } else { is_at_max };
        if is_top && self.mode.is_pwm() {
            self.compared = self.buffered;
        }
    }

    fn control(&mut self, mode: Mode, divisor: u64) {
        if !mode.counts_down() {
            (self.goes_down, self.has_turned) = (false, false);
        }
        if divisor != self.divisor {
            (self.divisor, self.phase) = (divisor, 0);
        }
        self.mode = mode;
    }

    fn set_counter(&mut self, value: u16) {
        self.value = value;
        (self.goes_down, self.has_turned, self.is_blocked) = (false, false, true);
    }

    fn compare(&mut self, unit: usize, value: u16) {
        self.buffered[unit] = value;
        if !self.mode.is_pwm() {
            self.compared[unit] = value;
        }
    }

    fn clear(&mut self) {
        (self.overflow, self.matched, self.captured) = (false, [false; 2], false);
    }
}

/// What the program does next, in OUT instructions: I/O address and value.
fn draw(random: &mut Random) -> Vec<(u16, u8)> {
    let word = |low: u16, value: u16| {
        let [low_byte, high_byte] = value.to_le_bytes();
        vec![(low + 1, high_byte), (low, low_byte)]
    };
    let mut near = |most: usize| random.below(most) as u16;
    match near(12) {
        0 => vec![(TCCR0, (near(2) << 6 | near(2) << 3 | near(4)) as u8)],
        1 => vec![(TCNT0, near(256) as u8)],
        2 | 3 => vec![(OCR0, (3 + near(60)) as u8)],
        4 => vec![(TCCR1A, near(4) as u8)],
        5 => vec![(TCCR1B, (near(4) << 3 | near(4)) as u8)],
        6 => word(TCNT1, [near(200), 0xffff - near(100)][usize::from(near(3) == 0)]),
        7 | 8 => word([OCR1A, OCR1B][usize::from(near(2))], 3 + near(200)),
        9 | 10 => word(ICR1, 3 + near(200)),
        _ => vec![(OUT_TIFR, 0xff)],
    }
}

/// The models of Timer0 and Timer1, and the registers that they need.
struct Models {
    timer0: Model,
    timer1: Model,
    control: [u8; 2],
    high: u8,
}

impl Models {
    fn write(&mut self, address: u16, value: u8) {
        let word = u16::from_le_bytes([value, self.high]);
        match address {
            TCCR0 => {
                let mode = Mode::of_narrow(value >> 6 & 1 | value >> 2 & 2);
                self.timer0.control(mode, [0, 1, 8, 32][usize::from(value & 3)]);
            }
            TCNT0 => self.timer0.set_counter(value.into()),
            OCR0 => self.timer0.compare(0, value.into()),
            TCCR1A | TCCR1B => {
                self.control[usize::from(address == TCCR1B)] = value;
                let [a, b] = self.control;
                let mode = Mode::of_wide(a & 3 | b >> 1 & 12);
                self.timer1.control(mode, [0, 1, 8, 64][usize::from(b & 7)]);
            }
            TCNT1 => self.timer1.set_counter(word),
            OCR1A => self.timer1.compare(0, word),
            OCR1B => self.timer1.compare(1, word),
            ICR1 if self.timer1.mode.top == Top::Capture => self.timer1.icr = word,
            ICR1 => {}
            OUT_TIFR => {
                self.timer0.clear();
                self.timer1.clear();
            }
            _ => self.high = value,
        }
    }

    /// TIFR, without Timer2's flags.
    fn flags(&self) -> u8 {
        let Self { timer0, timer1, .. } = self;
        let bits = [
            timer0.overflow,
            timer0.matched[0],
            timer1.overflow,
            timer1.matched[1],
            timer1.matched[0],
            timer1.captured,
        ];
        (0..).zip(bits).fold(0, |all, (bit, is_set)| all | u8::from(is_set) << bit)
    }
}

#[test]
fn flags_are_set_when_a_timer_counted_clock_by_clock_sets_them() {
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let (mut words, mut writes) = (Vec::new(), Vec::new());
        // The least top is 3 (section "Phase Correct PWM Mode").
        let mut first = Some(vec![(TCCR1B, 0x18), (ICR1, 99), (TCCR1B, 0), (OCR1A, 49), (OCR0, 49)]);
        while words.len() < 0x4000 {
            for (address, value) in first.take().unwrap_or_else(|| draw(&mut random)) {
                let nibbles = u16::from(value & 0xf0) << 4 | u16::from(value & 0xf);
                words.push(0xe000 | nibbles); // LDI r16
                writes.push((words.len() as u64, address, value));
                words.push(0xb900 | (address & 0x30) << 5 | address & 0xf);
            }
            let pause = [20, 300, 2000][random.below(3)];
            words.resize(words.len() + random.below(pause), NOP);
        }
        let mut flash: Vec<u8> = words.iter().flat_map(|word| u16::to_le_bytes(*word)).collect();
        flash.resize(0x2_0000, 0);
        let image = Arc::new(Image::of_flash(flash, true));
        let mut mcu = Mcu::new(Part::ATMEGA128, image, seed).expect("the image fits");
        let mut models =
            Models { timer0: Model::new(0xff), timer1: Model::new(0xffff), control: [0; 2], high: 0 };
        let mut next = writes.into_iter().peekable();
        for cycle in 0..words.len() as u64 {
            // Each instruction takes one cycle.
            mcu.step();
            assert_eq!(mcu.cycle(), cycle + 1);
            let write = next.next_if(|write| write.0 == cycle);
            if let Some((_, address, value)) = write {
                models.write(address, value);
            }
            models.timer0.cycle();
            models.timer1.cycle();
            let flags = mcu.read(TIFR).expect("it is a register") & 0x3f;
            assert_eq!(flags, models.flags(), "seed {seed}, cycle {cycle}, after {write:x?}");
        }
    }
}
