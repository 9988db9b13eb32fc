//! The timers of the ATmega128 (chapters "8-bit Timer/Counter" and "16-bit Timer/Counter"), in place of
//! simavr's. Of those, one misses a match that lies within an instruction of the counter's overflow, has no
//! double-buffered registers, overflows at the top of each mode, and comes back at once from beyond its top.
//!
//! A round of the counter is one way up, or one way down. A position in it is the number of the timer's
//! clocks since its begin. What happens at a position follows from the counter's value at the one before.
//!
//! Simplified: no crystal is at the pins TOSC; a clock at pin Tn is not delayed by its synchronisation; a
//! prescaler is never reset, and those of Timer0 to Timer2 begin when their clock is chosen.

mod mode;

use crate::cpu::{Cpu, Vector};
use crate::device::{Attached, Device, WrappedWrites, make_plain};
use crate::part::{Compare, Control, TimerRegisters};
use crate::repair::interrupt;
use mode::{Kind, Mode, Top};

/// TCCRn of a timer of 8 bits: force compare, mode, action on the pin.
const FOC: u8 = 0x80;
const WGM0: u8 = 0x40;
const WGM1: u8 = 0x08;
const COM_SHIFT: usize = 4;
/// TCCRnB: the edge that is captured.
const RISING: u8 = 0x40;
/// TCCRn, TCCRnB: the clock.
const CLOCK: u8 = 0x07;
/// The two clocks at pin Tn, falling and rising edges.
const FALLING_PIN: u8 = 6;
const RISING_PIN: u8 = 7;

/// The action of a compare unit on its pin (COMnx).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Output {
    Port,
    Toggle,
    Clear,
    Set,
}

/// What the counter counts.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Clock {
    /// It stands still.
    None,
    /// Cycles, divided by 2 to the power of this.
    Cpu(u32),
    /// Edges at pin Tn.
    Pin { rising: bool },
}

/// One way of the counter.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    /// Up from 0. `turned`: it has come down before.
    Up { turned: bool },
    /// Down from this value.
    Down(u16),
}

const UP: Way = Way::Up { turned: false };

#[derive(Clone)]
pub(crate) struct Timer {
    registers: &'static TimerRegisters,
    compare: [Option<Vector>; 3],
    overflow: Vector,
    capture: Option<Vector>,
    clock: Clock,
    mode: Mode,
    way: Way,
    /// The cycle at which the present round began, if cycles are counted. Otherwise, the position.
    began_at: u64,
    stands_at: u64,
    /// What happens at positions up to this one has happened.
    done: u64,
    /// The position at which no unit matches, as the program has set the counter just before.
    blocked: Option<u64>,
    /// The compare registers as they are compared, and the buffers from which they are loaded in PWM modes.
    compared: [u16; 3],
    buffered: [u16; 3],
    icr: u16,
    /// The high byte on its way to or from a 16-bit register.
    high: u8,
    /// The levels last seen at the pins of the capture unit and of the clock.
    capture_level: bool,
    clock_level: bool,
    /// The levels that the compare units output (register OCnx), and whether each drives its pin.
    outputs: [bool; 3],
    drives: [bool; 3],
}

/// Makes a one clear a flag that lies beside another timer's, as OCF1C does in ETIFR: simavr tells writes
/// there to that timer alone.
pub(crate) fn install(cpu: Cpu, timers: &[TimerRegisters], wrapped: &mut WrappedWrites) {
    for timer in timers {
        let vectors = timer.compare.iter().filter_map(|unit| cpu.vector(unit.vector));
        let home = cpu.vector(timer.overflow).map(|vector| vector.flag_bit().address);
        for vector in vectors.filter(|vector| Some(vector.flag_bit().address) != home) {
            let flag = vector.flag_bit();
            wrapped.wrap(cpu, flag.address, move |cpu, register, _, written| {
                cpu.set_bits(register, flag.mask & written, false);
                interrupt::refresh(cpu, vector);
            });
        }
    }
}

/// Replaces simavr's timer by the harness's. `None`: the part has no such vectors.
pub(crate) fn attach(cpu: Cpu, registers: &'static TimerRegisters) -> Option<Attached<Timer>> {
    let mut compare = [None; 3];
    for (vector, unit) in compare.iter_mut().zip(registers.compare) {
        *vector = Some(cpu.vector(unit.vector)?);
    }
    let timer = Timer {
        registers,
        compare,
        overflow: cpu.vector(registers.overflow)?,
        capture: registers.capture.as_ref().and_then(|capture| cpu.vector(capture.vector)),
        clock: Clock::None,
        mode: Mode::normal(registers.max()),
        way: UP,
        began_at: 0,
        stands_at: 0,
        done: 0,
        blocked: None,
        compared: [0; 3],
        buffered: [0; 3],
        icr: 0,
        high: 0,
        capture_level: false,
        clock_level: false,
        outputs: [false; 3],
        drives: [false; 3],
    };
    let writes = registers.all();
    make_plain(cpu, &writes);
    let attached = Attached::new(cpu, timer, &writes, &registers.read());
    let capture = registers.capture.as_ref().map(|capture| capture.pin);
    for pin in capture.into_iter().chain(registers.clock_pin) {
        attached.watch_pin(cpu, pin.port, pin.bit);
    }
    Some(attached)
}

impl Timer {
    /// Sets the registers to their values after a reset.
    pub fn reset(&mut self, cpu: Cpu) {
        if let Some(capture) = &self.registers.capture {
            cpu.disconnect_capture(self.registers.name, capture.pin.port, capture.pin.bit);
        }
        self.clock = Clock::None;
        self.mode = Mode::normal(self.registers.max());
        self.way = UP;
        (self.stands_at, self.done, self.blocked) = (0, 0, None);
        (self.compared, self.buffered, self.icr) = ([0; 3], [0; 3], 0);
        self.high = 0;
        (self.outputs, self.drives) = ([false; 3], [false; 3]);
    }

    // --- The counter ----------------------------------------------------------------------------

    fn top(&self) -> u16 {
        match self.mode.top {
            Top::Fixed(top) => top,
            Top::CompareA => self.compared[0],
            Top::Capture => self.icr,
        }
    }

    fn position(&self, now: u64) -> u64 {
        match self.clock {
            Clock::Cpu(bits) => now.wrapping_sub(self.began_at) >> bits,
            Clock::None | Clock::Pin { .. } => self.stands_at,
        }
    }

    /// The counter's value at a position of the present round.
    fn value(&self, position: u64) -> u16 {
        match self.way {
            Way::Up { .. } => position as u16,
            Way::Down(from) => from.saturating_sub(position as u16),
        }
    }

    fn counter(&self, now: u64) -> u16 {
        self.value(self.position(now))
    }

    /// The last value on the way up: a counter beyond its top counts on to its maximum.
    fn last(&self) -> u16 {
        let top = self.top();
        if self.done > u64::from(top) { self.registers.max() } else { top }
    }

    /// The position at which the present round ends, at least 1.
    fn length(&self) -> u64 {
        match self.way {
            Way::Up { .. } => {
                let last = self.last();
                let turns = self.mode.counts_down() && last == self.top();
                (u64::from(last) + u64::from(!turns)).max(1)
            }
            Way::Down(from) => u64::from(from).max(1),
        }
    }

    /// The position at which a unit matches in the present round, if it does.
    fn match_position(&self, unit: usize) -> u64 {
        let value = self.compared[unit];
        match self.way {
            Way::Up { .. } => u64::from(value) + 1,
            Way::Down(from) if value > from => u64::MAX,
            Way::Down(from) => u64::from(from - value) + 1,
        }
    }

    fn matches_at(&self, unit: usize, position: u64) -> bool {
        self.match_position(unit) == position && self.blocked != Some(position)
    }

    /// The next position at which anything happens.
    fn next(&self) -> u64 {
        if self.way != UP && self.done == 0 {
            return 1;
        }
        let mut next = self.length();
        for unit in 0..self.registers.compare.len() {
            let at = self.match_position(unit);
            if at > self.done && at < next && self.blocked != Some(at) {
                next = at;
            }
        }
        next
    }

    /// Changes the position, and keeps the prescaler as it is.
    fn move_to(&mut self, cpu: Cpu, position: u64) {
        if let Clock::Cpu(bits) = self.clock {
            let by = self.position(cpu.cycle()).wrapping_sub(position) << bits;
            self.began_at = self.began_at.wrapping_add(by);
        }
        self.stands_at = position;
        self.done = position;
        self.blocked = None;
    }

    /// Before the top changes: a counter that is at its top turns only if it still is there one clock later.
    fn unturn(&mut self, cpu: Cpu) {
        if let Way::Down(from) = self.way
            && self.position(cpu.cycle()) == 0
        {
            self.way = UP;
            self.move_to(cpu, from.into());
        }
    }

    /// What the program chose in the control registers.
    fn chosen(&self, cpu: Cpu) -> (Mode, Clock) {
        let (mode, select, has_crystal) = match self.registers.control {
            Control::Narrow { tccr, crystal } => {
                let value = cpu.data(tccr);
                let number = u8::from(value & WGM0 != 0) | u8::from(value & WGM1 != 0) << 1;
                let has_crystal = crystal.is_some_and(|(assr, bit)| cpu.data(assr) & bit != 0);
                (Mode::of_narrow(number), value & CLOCK, has_crystal)
            }
            Control::Wide { a, b, .. } => {
                let (a, b) = (cpu.data(a), cpu.data(b));
                (Mode::of_wide(b >> 1 & 0b1100 | a & 0b11), b & CLOCK, false)
            }
        };
        let clock = match self.registers.prescaler[usize::from(select)] {
            _ if has_crystal => Clock::None,
            Some(bits) => Clock::Cpu(bits),
            None if self.registers.clock_pin.is_none() => Clock::None,
            None if select == FALLING_PIN => Clock::Pin { rising: false },
            None if select == RISING_PIN => Clock::Pin { rising: true },
            None => Clock::None,
        };
        (mode, clock)
    }

    /// Follows the control registers. The counter keeps its value.
    fn follow_control(&mut self, cpu: Cpu) {
        let now = cpu.cycle();
        let (mode, clock) = self.chosen(cpu);
        self.unturn(cpu);
        let mut position = self.position(now);
        if self.way != UP && !mode.counts_down() {
            position = self.value(position).into();
            self.way = UP;
            self.move_to(cpu, position);
        }
        if clock != self.clock {
            self.stands_at = position;
            self.clock = clock;
            if let Clock::Cpu(bits) = clock {
                let began = if self.registers.prescaler_runs_on { now >> bits << bits } else { now };
                self.began_at = began.wrapping_sub(position << bits);
            }
        }
        self.mode = mode;
        self.done = position;
        self.connect(cpu);
    }

    // --- The pins -------------------------------------------------------------------------------

    fn output(&self, cpu: Cpu, unit: usize) -> Output {
        let (register, shift) = match self.registers.control {
            Control::Narrow { tccr, .. } => (tccr, COM_SHIFT),
            Control::Wide { a, .. } => (a, 6 - 2 * unit),
        };
        match cpu.data(register) >> shift & 3 {
            0 => Output::Port,
            // In a PWM mode only the unit that is the top toggles its pin.
            1 if self.mode.is_pwm() && (unit != 0 || self.mode.top != Top::CompareA) => Output::Port,
            1 => Output::Toggle,
            2 => Output::Clear,
            _ => Output::Set,
        }
    }

    /// Changes the output of a unit at a match, or at a forced one. On the way down PWM does the opposite of
    /// what it does on the way up.
    fn change_output(&mut self, cpu: Cpu, unit: usize) {
        let goes_down = matches!(self.way, Way::Down(_));
        match self.output(cpu, unit) {
            Output::Port => {}
            Output::Toggle => self.set_output(cpu, unit, !self.outputs[unit]),
            Output::Clear => self.set_output(cpu, unit, goes_down),
            Output::Set => self.set_output(cpu, unit, !goes_down),
        }
    }

    /// Fast PWM begins its pulses at the bottom.
    fn begin_pulses(&mut self, cpu: Cpu) {
        for unit in 0..self.registers.compare.len() {
            match self.output(cpu, unit) {
                Output::Port | Output::Toggle => {}
                Output::Clear => self.set_output(cpu, unit, true),
                Output::Set => self.set_output(cpu, unit, false),
            }
        }
    }

    fn set_output(&mut self, cpu: Cpu, unit: usize, level: bool) {
        let &Compare { port, bit, .. } = &self.registers.compare[unit];
        self.outputs[unit] = level;
        cpu.output_pin(port, bit, level);
    }

    /// Connects units to their pins, and disconnects them, as the control registers have it.
    fn connect(&mut self, cpu: Cpu) {
        for (unit, &Compare { port, bit, .. }) in self.registers.compare.iter().enumerate() {
            let drives = self.output(cpu, unit) != Output::Port;
            match (std::mem::replace(&mut self.drives[unit], drives), drives) {
                (false, true) => cpu.output_pin(port, bit, self.outputs[unit]),
                (true, false) => cpu.release_pin(port, bit),
                _ => {}
            }
        }
    }

    // --- What happens ---------------------------------------------------------------------------

    /// The counter comes to the next position at which anything happens.
    fn happen(&mut self, cpu: Cpu, position: u64) {
        let (length, last) = (self.length(), self.last());
        self.done = position;
        for unit in 0..self.registers.compare.len() {
            if self.matches_at(unit, position) {
                if let Some(vector) = self.compare[unit] {
                    cpu.raise(vector);
                }
                self.change_output(cpu, unit);
            }
        }
        if position == 1 {
            self.leave_turning_point(cpu);
        }
        if position == length {
            self.begin_round(cpu, length, last);
        }
    }

    /// One clock after the counter was at its top, on the way down, or at its bottom, on the way up.
    fn leave_turning_point(&mut self, cpu: Cpu) {
        let loads = match self.way {
            Way::Up { turned: false } => return,
            Way::Up { turned: true } => {
                cpu.raise(self.overflow);
                Kind::FrequencyCorrect
            }
            Way::Down(_) => {
                self.flag_top(cpu);
                Kind::PhaseCorrect
            }
        };
        if self.mode.kind == loads {
            self.compared = self.buffered;
        }
    }

    /// The capture unit's flag is set at the top if that is its register.
    fn flag_top(&self, cpu: Cpu) {
        if let Some(capture) = self.capture.filter(|_| self.mode.top == Top::Capture) {
            cpu.raise(capture);
        }
    }

    /// The counter has come to the end of its round, on the way up to `last`.
    fn begin_round(&mut self, cpu: Cpu, length: u64, last: u16) {
        if let Clock::Cpu(bits) = self.clock {
            self.began_at = self.began_at.wrapping_add(length << bits);
        }
        (self.stands_at, self.done, self.blocked) = (0, 0, None);
        let is_top = last == self.top();
        self.way = match self.way {
            Way::Down(_) => Way::Up { turned: true },
            Way::Up { .. } if self.mode.counts_down() && is_top => Way::Down(last),
            Way::Up { .. } => UP,
        };
        if self.mode.counts_down() {
            return;
        }
        if is_top {
            self.flag_top(cpu);
        }
        let is_pwm = self.mode.is_pwm();
        let overflows = if is_pwm { is_top } else { last == self.registers.max() };
        if overflows {
            cpu.raise(self.overflow);
        }
        if is_top && is_pwm {
            self.compared = self.buffered;
            self.begin_pulses(cpu);
        }
    }

    // --- What the program writes ----------------------------------------------------------------

    /// Sets the counter. The next clock of the timer then makes no match.
    fn set_counter(&mut self, cpu: Cpu, value: u16) {
        self.move_to(cpu, value.into());
        self.way = UP;
        self.blocked = Some(u64::from(value) + 1);
    }

    /// Timer3 without PWM "will access the OCR3x directly". This is read to mean that the buffer keeps its
    /// value, which is the harder reading for the UART in software.
    fn write_compare(&mut self, cpu: Cpu, unit: usize, value: u16) {
        let is_pwm = self.mode.is_pwm();
        if is_pwm || !self.registers.keeps_buffers {
            self.buffered[unit] = value;
        }
        if !is_pwm {
            self.compared[unit] = value;
            self.done = self.position(cpu.cycle()); // a value that the counter has passed is no match
        }
    }

    fn write_capture(&mut self, cpu: Cpu, register: u16, value: u16) {
        if self.chosen(cpu).0.top == Top::Capture {
            self.unturn(cpu);
            self.set_capture(cpu, register, value);
            self.done = self.position(cpu.cycle()); // a value that the counter has passed is no top
        }
    }

    fn set_capture(&mut self, cpu: Cpu, register: u16, value: u16) {
        self.icr = value;
        self.show(cpu, register, value);
    }

    /// Stores a value for the program to read.
    fn show(&self, cpu: Cpu, register: u16, value: u16) {
        let [low, high] = value.to_le_bytes();
        cpu.set_data(register, low);
        if self.registers.is_wide() {
            cpu.set_data(register + 1, high);
        }
    }

    /// FOCnx are strobes, and work only in a mode without PWM. The highest bit is unit A's.
    fn force(&mut self, cpu: Cpu, value: u8) {
        for unit in 0..self.registers.compare.len() {
            if !self.mode.is_pwm() && value & FOC >> unit != 0 {
                self.change_output(cpu, unit);
            }
        }
    }

    fn write_register(&mut self, cpu: Cpu, address: u16, value: u8) {
        let high = if self.registers.is_wide() { self.high } else { 0 };
        let word = u16::from_le_bytes([value, high]);
        if address == self.registers.counter {
            self.set_counter(cpu, word);
        } else if let Some(unit) = self.registers.compare.iter().position(|unit| unit.register == address) {
            self.write_compare(cpu, unit, word);
            self.show(cpu, address, word);
        } else if self.registers.capture.as_ref().is_some_and(|unit| unit.register == address) {
            self.write_capture(cpu, address, word);
        } else {
            self.high = value;
        }
    }
}

impl Device for Timer {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        // Matches and overflows that are due come before the write.
        while let Some(due) = self.due().filter(|&due| due <= cpu.cycle()) {
            self.expire(cpu, due);
        }
        match self.registers.control {
            Control::Narrow { tccr, .. } if address == tccr => {
                cpu.set_data(address, value & !FOC);
                self.follow_control(cpu);
                self.force(cpu, value);
            }
            Control::Wide { a, b, .. } if address == a || address == b => {
                cpu.set_data(address, value);
                self.follow_control(cpu);
            }
            Control::Wide { c, .. } if address == c => self.force(cpu, value),
            _ => self.write_register(cpu, address, value),
        }
    }

    fn read(&mut self, cpu: Cpu, address: u16) -> u8 {
        let value = if address == self.registers.counter {
            self.counter(cpu.cycle())
        } else if self.registers.capture.as_ref().is_some_and(|unit| unit.register == address) {
            self.icr
        } else {
            return self.high;
        };
        let [low, high] = value.to_le_bytes();
        self.high = high;
        low
    }

    fn due(&self) -> Option<u64> {
        match self.clock {
            Clock::Cpu(bits) => Some(self.began_at.wrapping_add(self.next() << bits)),
            Clock::None | Clock::Pin { .. } => None,
        }
    }

    fn expire(&mut self, cpu: Cpu, now: u64) {
        self.happen(cpu, self.position(now));
    }

    fn pin_changed(&mut self, cpu: Cpu, bit: u8, is_high: bool) {
        if self.registers.clock_pin.is_some_and(|pin| pin.bit == bit) {
            let was_high = std::mem::replace(&mut self.clock_level, is_high);
            if was_high != is_high && self.clock == (Clock::Pin { rising: is_high }) {
                self.stands_at += 1;
                if self.next() == self.stands_at {
                    self.happen(cpu, self.stands_at);
                }
            }
            return;
        }
        let (Some(capture), Control::Wide { b, .. }) = (&self.registers.capture, self.registers.control)
        else {
            return;
        };
        let was_high = std::mem::replace(&mut self.capture_level, is_high);
        let is_wanted = was_high != is_high && (cpu.data(b) & RISING != 0) == is_high;
        if is_wanted && self.chosen(cpu).0.top != Top::Capture {
            self.set_capture(cpu, capture.register, self.counter(cpu.cycle()));
            if let Some(vector) = self.capture {
                cpu.raise(vector);
            }
        }
    }
}

#[cfg(test)]
mod tests;
