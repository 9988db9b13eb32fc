//! One microcontroller with its program.

use std::sync::Arc;

use simulation::{CLOCK_HZ, Random, fnv_1a};
use thiserror::Error;

use crate::character::Character;
use crate::cpu::{Core, CoreState, Cpu, IO_START, News, Reset};
use crate::device::{Attached, WrappedWrites, make_plain};
use crate::image::{Image, Place};
use crate::marker::{self, Marker, Markers};
use crate::part::{Part, Pin};
use crate::probe::{self, Edge, Probe};
use crate::repair::adc::{self, Adc, Analog};
use crate::repair::eeprom::{self, Eeprom};
use crate::repair::external::{self, External};
use crate::repair::ports;
use crate::repair::spi::{self, Spi};
use crate::repair::spm::{self, Spm, WhileWriting};
use crate::repair::timer::{self, Timer};
use crate::repair::twi::{self, Twi};
use crate::repair::unread::{self, Unread};
use crate::repair::usart::{self, Usart, UsartCounts};
use crate::repair::watchdog;
use crate::repair::{absent, flags, interrupt, pins, rampz, reset_flags, zeros};
use crate::serial_pins::{self, PinSerial, SerialPinCounts, SerialPins};
use crate::trace::{NotTraceable, Trace, Tracer};
use crate::wires::{self, Wires};

mod debug;
mod explore;
pub mod job;
pub mod masked;
mod running;

pub use debug::Debugger;
use job::Jobs;
use masked::Windows;

/// Data address of the status register.
const SREG: u16 = 0x5f;

/// A microcontroller that runs a program, cycle by cycle. Time is in cycles since power-up; no reset
/// sets it back.
pub struct Mcu {
    part: &'static Part,
    image: Arc<Image>,
    cpu: Cpu,
    markers: Attached<Markers>,
    usarts: Vec<Attached<Usart>>,
    /// The wires of a two-wire bus at the pins, if there is one.
    wires: Option<Attached<Wires>>,
    twi: Attached<Twi>,
    eeprom: Attached<Eeprom>,
    /// `None`: simavr's own stays.
    adc: Option<Attached<Adc>>,
    /// `None`: simavr's own stays.
    spm: Option<Attached<Spm>>,
    /// "Store Program Memory Ready" waits for the EEPROM. Kept here because each turn reads it.
    spm_waits: bool,
    /// `None`: simavr's own stay.
    external: Option<Attached<External>>,
    /// `None`: simavr's own stays.
    spi: Option<Attached<Spi>>,
    /// Empty: simavr's own stay.
    timers: Vec<Attached<Timer>>,
    // Held for simavr, which calls into them.
    _wrapped: WrappedWrites,
    _ports: Vec<Attached<ports::Reads>>,
    unread: Vec<Attached<Unread>>,
    /// Serial ports at pins rather than USARTs.
    serial_pins: Vec<Attached<PinSerial>>,
    probes: Vec<Attached<Probe>>,
    random: Random,
    awake_cycles: u64,
    /// The core was asleep at the end of its last run: the next interrupt wakes it.
    asleep: bool,
    /// Whether the last instruction enabled interrupts.
    enabled_just_now: bool,
    ended: Option<State>,
    resets: u64,
    /// How long a reset lasts, in cycles, and the cycle at which the last one is over.
    start_up: u64,
    starts_at: u64,
    /// The address at which the program hangs.
    hangs_at: Option<u32>,
    tracer: Option<Box<Tracer>>,
    debugger: Option<Box<dyn Debugger>>,
    /// The masked windows, if they are recorded.
    pub(crate) windows: Option<Windows>,
    /// The jobs of tasks that are recorded.
    pub(crate) jobs: Vec<Jobs>,
}

/// What an MCU is doing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    Running,
    Sleeping,
    /// The program went to sleep with interrupts off; test programs end this way.
    Done,
    /// It has no power.
    Off,
    /// The program did something invalid; simavr's message.
    Crashed(String),
}

/// An interrupt that the core has just accepted: the next instruction is the one at its vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Accepted {
    pub vector: u8,
    /// The interrupt response: 4 cycles, or 8 if the interrupt ended a sleep; 5 or 10 on a part with a
    /// program counter of 3 bytes.
    pub response_cycles: u64,
}

/// Why there is no MCU.
#[derive(Debug, Error)]
pub enum McuError {
    #[error("simavr was built without the {0}; install avr-libc and rebuild simavr-ffi")]
    NotInSimavr(&'static str),
    #[error("the image takes {image} bytes of flash, but the {part} has {flash}")]
    TooLarge { image: usize, part: &'static str, flash: usize },
}

/// A symbol does not exist, or is not in the data space.
#[derive(Debug, Error)]
#[error("the image has no symbol \"{0}\" in the data space")]
pub struct NoSuchData(String);

impl Mcu {
    /// A new MCU at power-up. SRAM and registers hold a pattern drawn from `seed`, as real ones hold
    /// chance values.
    ///
    /// # Errors
    /// simavr does not have the part, or the image does not fit it.
    pub fn new(part: &'static Part, image: Arc<Image>, seed: u64) -> Result<Self, McuError> {
        let missing = || McuError::NotInSimavr(part.name);
        let cpu = Cpu::create(part.name, CLOCK_HZ).ok_or_else(missing)?;
        pins::install(cpu, part);
        let mut wrapped = interrupt::install(cpu);
        rampz::install(cpu, &mut wrapped);
        reset_flags::install(cpu, &mut wrapped);
        watchdog::install(cpu, &mut wrapped);
        if part.has_mcucr {
            absent::install(cpu, &mut wrapped);
            zeros::install(cpu, &mut wrapped);
        }
        timer::install(cpu, part.timers, &mut wrapped);
        ports::install(cpu, part.timers, &mut wrapped);
        flags::install(cpu, part);
        let usarts = part.usarts.iter().map(|registers| usart::attach(cpu, registers)).collect();
        let adc = part.adc.as_ref().map(|registers| adc::attach(cpu, registers).ok_or_else(missing));
        let spm = part
            .spm
            .as_ref()
            .map(|registers| spm::attach(cpu, registers, part.eeprom.eecr).ok_or_else(missing));
        let external = part.has_external_and_spi.then(|| external::attach(cpu).ok_or_else(missing));
        let spi = part.has_external_and_spi.then(|| spi::attach(cpu).ok_or_else(missing));
        let timers = part.timers.iter().map(|registers| timer::attach(cpu, registers)).collect();
        let mut mcu = Self {
            part,
            markers: marker::attach(cpu, part.marker),
            usarts: Option::ok_or_else(usarts, missing)?,
            wires: None,
            twi: twi::attach(cpu, &part.twi).ok_or_else(missing)?,
            eeprom: eeprom::attach(cpu, &part.eeprom).ok_or_else(missing)?,
            adc: adc.transpose()?,
            spm: spm.transpose()?,
            spm_waits: false,
            external: external.transpose()?,
            spi: spi.transpose()?,
            timers: Option::ok_or_else(timers, missing)?,
            cpu,
            image,
            _wrapped: wrapped,
            _ports: ports::attach(cpu, part.timers),
            unread: Vec::new(),
            serial_pins: Vec::new(),
            probes: Vec::new(),
            random: Random::new(seed),
            awake_cycles: 0,
            asleep: false,
            enabled_just_now: false,
            ended: None,
            resets: 0,
            start_up: 0,
            starts_at: 0,
            hangs_at: None,
            tracer: None,
            debugger: None,
            windows: None,
            jobs: Vec::new(),
        };
        let (image, flash) = (mcu.image.flash(), cpu.flash_size());
        if image.len() > flash {
            return Err(McuError::TooLarge { image: image.len(), part: part.name, flash });
        }
        cpu.load_flash(image);
        if let Some(shared) = mcu.image.shared_flash(cpu) {
            // SAFETY: the program has no SPM, and the image lives as long as the MCU, whose instance this is.
            unsafe { cpu.share_flash(shared) };
        }
        mcu.reset(Reset::PowerOn);
        mcu.resets = 0;
        Ok(mcu)
    }

    // --- Looking --------------------------------------------------------------------------------

    pub fn part(&self) -> &'static Part {
        self.part
    }

    pub(crate) fn cpu(&self) -> Cpu {
        self.cpu
    }

    pub fn image(&self) -> &Arc<Image> {
        &self.image
    }

    pub fn state(&self) -> State {
        match (&self.ended, self.cpu.core()) {
            (Some(end), _) => end.clone(),
            (None, Core::Sleeping) => State::Sleeping,
            (None, _) => State::Running,
        }
    }

    /// Whether the program still runs or sleeps: it is neither done nor crashed nor without power.
    pub fn is_alive(&self) -> bool {
        self.ended.is_none()
    }

    /// Why the program crashed, if it did.
    pub fn crash_reason(&self) -> Option<&str> {
        match &self.ended {
            Some(State::Crashed(reason)) => Some(reason),
            _ => None,
        }
    }

    /// Cycles since power-up.
    pub fn cycle(&self) -> u64 {
        self.cpu.cycle()
    }

    /// The cycles since power-up in which the core did not sleep.
    pub fn awake_cycles(&self) -> u64 {
        self.awake_cycles
    }

    /// How often the MCU was reset, by the watchdog or from outside.
    pub fn resets(&self) -> u64 {
        self.resets
    }

    /// Whether an event is pending.
    pub(crate) fn has(&self, news: News) -> bool {
        self.cpu.has(news)
    }

    /// Clears the pending flag of an event. Returns whether it was set.
    pub(crate) fn take(&mut self, news: News) -> bool {
        self.cpu.take(news)
    }

    /// Address of the next instruction, in bytes.
    pub fn pc(&self) -> u32 {
        self.cpu.pc()
    }

    pub fn stack_pointer(&self) -> u16 {
        self.cpu.stack_pointer()
    }

    /// Whether the I flag is set.
    pub fn interrupts_enabled(&self) -> bool {
        self.cpu.interrupts_enabled()
    }

    /// The byte at `address` of the data space; `None` beyond its end. This has no side effects, not even
    /// on a register that a read by the program would change.
    pub fn read(&self, address: u16) -> Option<u8> {
        if address == SREG {
            return Some(self.cpu.status_register());
        }
        self.cpu.with_data(|data| data.get(usize::from(address)).copied())
    }

    /// Writes a byte of SRAM or a register, without the side effects of a write by the program.
    /// Addresses beyond the data space are ignored.
    pub fn write(&mut self, address: u16, value: u8) {
        if address == SREG {
            self.set_status(value);
        }
        self.cpu.with_data_mut(|data| {
            if let Some(byte) = data.get_mut(usize::from(address)) {
                *byte = value;
            }
        });
    }

    /// Sets SREG of the core, which keeps the bits separately. If this enables interrupts, a pending one is
    /// accepted after the next instruction, as on the chip.
    fn set_status(&mut self, status: u8) {
        let were_enabled = self.interrupts_enabled();
        self.cpu.set_core_state(CoreState { status, ..self.cpu.core_state() });
        if self.interrupts_enabled() && !were_enabled {
            self.cpu.enable_interrupts();
        }
    }

    /// The bytes of a variable of the program.
    ///
    /// # Errors
    /// The image has no such symbol in the data space.
    pub fn read_symbol(&self, name: &str) -> Result<Vec<u8>, NoSuchData> {
        let symbol = self.image.symbol(name);
        symbol
            .and_then(|symbol| {
                let Place::Data(start) = symbol.place else { return None };
                let range = usize::from(start)..usize::from(start) + usize::from(symbol.size);
                self.cpu.with_data(|data| data.get(range).map(<[u8]>::to_vec))
            })
            .ok_or_else(|| NoSuchData(name.to_owned()))
    }

    /// The contents of the EEPROM. A new one is erased.
    pub fn eeprom(&self) -> &[u8] {
        self.eeprom.get().contents()
    }

    /// Writes the EEPROM as a programmer does. Bytes beyond its end are dropped.
    pub fn program_eeprom(&mut self, address: u16, bytes: &[u8]) {
        let cpu = self.cpu;
        self.eeprom.with(cpu, |eeprom| eeprom.program(address, bytes));
    }

    /// A hash of the state that decides what the program does next: data space, SREG, program counter
    /// and clock (FNV-1a, 64 bits).
    pub fn state_hash(&self) -> u64 {
        let cpu = self.cpu;
        let rest = [cpu.status_register().into(), cpu.pc().into(), cpu.cycle()];
        let rest = rest.into_iter().flat_map(u64::to_le_bytes);
        cpu.with_data(|data| fnv_1a(data.iter().copied().chain(rest)))
    }

    // --- Markers --------------------------------------------------------------------------------

    /// The markers since power-up or since they were last taken.
    pub fn markers(&self) -> &[Marker] {
        &self.markers.get().log
    }

    pub fn take_markers(&mut self) -> Vec<Marker> {
        self.markers.with(self.cpu, |markers| std::mem::take(&mut markers.log))
    }

    // --- Trace ----------------------------------------------------------------------------------

    /// Records from now on which task has the CPU, what tasks wait for, and interrupts. Call it before the
    /// program runs. It does not change the run.
    ///
    /// # Errors
    /// The program has no kernel of ours.
    pub fn trace(&mut self) -> Result<(), NotTraceable> {
        self.tracer = Some(Box::new(Tracer::new(self.cpu, &self.image, self.cycle())?));
        Ok(())
    }

    /// Ends the trace and returns it; `None` if there was none.
    pub fn take_trace(&mut self) -> Option<Trace> {
        let cycle = self.cycle();
        self.tracer.take().map(|tracer| tracer.finish(cycle))
    }

    // --- The outside ----------------------------------------------------------------------------

    /// Drives a pin from outside to `level`. The level stays through resets.
    pub fn drive_pin(&mut self, pin: Pin, level: bool) {
        self.act_from_outside(|mcu| mcu.cpu.drive_pin(pin.port, pin.bit, level));
    }

    /// The level of a pin as it could be measured: that of the output latch, or of the input.
    pub fn pin(&self, pin: Pin) -> bool {
        self.cpu.is_high(pin)
    }

    /// Changes the voltages at the analog inputs of an ATmega128. They stay through resets; AVCC and AREF are
    /// 5 V.
    pub fn set_analog(&mut self, change: impl FnOnce(&mut Analog)) {
        let cpu = self.cpu;
        if let Some(adc) = &mut self.adc {
            adc.with(cpu, |adc| change(&mut adc.analog));
        }
    }

    /// From now on a write to the EEPROM affects "Store Program Memory Ready" in this way, as it may on the
    /// chip.
    pub fn disturb_spm(&mut self, how: WhileWriting) {
        let cpu = self.cpu;
        self.spm_waits = how == WhileWriting::Waits;
        if let Some(spm) = &mut self.spm {
            spm.with(cpu, |spm| spm.while_writing = Some(how));
        }
    }

    /// Ends the program, which relies on what is not simulated.
    pub(crate) fn crash_for(&mut self, reason: &str) {
        if self.is_alive() {
            self.cpu.report(reason);
        }
    }

    /// Makes registers plain memory: what the program writes there has no effect in simavr.
    pub(crate) fn make_plain(&mut self, registers: &[u16]) {
        make_plain(self.cpu, registers);
    }

    /// Ends the program for `reason` if it reads one of these registers.
    pub(crate) fn refuse_reads(&mut self, registers: &[u16], reason: &'static str) {
        self.unread.push(unread::attach(self.cpu, registers, reason));
    }

    /// Watches a pin from now on. Probes are numbered from 0.
    pub fn add_probe(&mut self, pin: Pin) {
        self.probes.push(probe::attach(self.cpu, pin));
    }

    /// Takes the edges that a probe has seen since the last call.
    pub fn take_edges(&mut self, number: usize) -> Vec<Edge> {
        let cpu = self.cpu;
        self.probes.get_mut(number).map(|probe| probe.with(cpu, Probe::take)).unwrap_or_default()
    }

    /// The cycle since power-up at which the program began, or will begin once the last reset is over.
    pub(crate) fn starts_at(&self) -> u64 {
        self.starts_at
    }

    /// Raises an interrupt by its vector number, as its source would; `false` if there is no such vector.
    pub fn raise_interrupt(&mut self, vector: u8) -> bool {
        let vector = self.cpu.vector(vector);
        if let Some(vector) = vector {
            self.act_from_outside(|mcu| mcu.cpu.raise(vector));
        }
        vector.is_some()
    }

    /// Sets the cycle at which an MCU that has not run yet gets its power.
    pub(crate) fn power_up_at(&mut self, cycle: u64) {
        self.cpu.set_cycle(cycle);
    }

    /// Cuts the power: no pin drives anything any more. A power-on reset restores the power.
    pub(crate) fn power_down(&mut self) {
        self.ended = Some(State::Off);
        let io = usize::from(IO_START)..usize::from(self.cpu.ram_start());
        self.cpu.with_data_mut(|data| data[io].fill(0));
    }

    /// Resets the MCU and starts the program over, even one that has crashed or is done.
    pub fn reset(&mut self, cause: Reset) {
        let now = self.cycle();
        self.cpu.note_reset(cause);
        self.cpu.reset();
        if cause == Reset::PowerOn {
            let ram = usize::from(self.cpu.ram_start());
            let random = &mut self.random;
            self.cpu.with_data_mut(|data| {
                random.fill(&mut data[..0x20]);
                random.fill(&mut data[ram..]);
            });
        }
        self.ended = None;
        self.complete_reset(now);
    }

    /// Makes every reset from now on last for `cycles`, in which the MCU does nothing: by its fuses it waits
    /// for the supply and the crystal to settle (chapter "System Clock and Clock Options"). Unless this is
    /// called, resets take no time; for the MCUs of a robot it is called.
    pub fn set_start_up(&mut self, cycles: u64) {
        self.start_up = cycles;
    }

    /// Makes the program hang where it is, as if the next instruction jumped to itself, until the next reset.
    /// Interrupts are still served. Returns `false`, and changes nothing, while the MCU sleeps, has
    /// interrupts masked or has just enabled them.
    pub fn hang(&mut self) -> bool {
        let can_hang =
            self.cpu.core() == Core::Running && self.interrupts_enabled() && !self.enabled_just_now;
        if can_hang {
            self.hangs_at = Some(self.pc());
        }
        can_hang
    }

    /// Completes a reset, in which simavr has set its clock back, dropped all timers and forgotten which pins
    /// the outside drives.
    fn complete_reset(&mut self, now: u64) {
        let cpu = self.cpu;
        cpu.set_cycle(now);
        self.resets += 1;
        self.asleep = false;
        self.starts_at = now + self.start_up;
        if let Some(tracer) = &mut self.tracer {
            tracer.reset(now, self.starts_at);
        }
        self.hangs_at = None;
        for usart in &mut self.usarts {
            usart.forget_timer();
            usart.with(cpu, |usart| usart.reset(cpu));
        }
        self.twi.with(cpu, |twi| twi.reset(cpu));
        self.eeprom.forget_timer();
        self.eeprom.with(cpu, |eeprom| eeprom.reset(cpu));
        if let Some(adc) = &mut self.adc {
            adc.forget_timer();
            adc.with(cpu, |adc| adc.reset(cpu));
        }
        for timer in &mut self.timers {
            timer.forget_timer();
            timer.with(cpu, |timer| timer.reset(cpu));
        }
        if let Some(spi) = &mut self.spi {
            spi.forget_timer();
            spi.with(cpu, |spi| spi.reset(cpu));
        }
        if let Some(external) = &mut self.external {
            external.with(cpu, |external| external.reset(cpu));
        }
        cpu.restore_pins();
        for serial in &mut self.serial_pins {
            serial.forget_timer();
            serial.with(cpu, PinSerial::reset);
        }
    }

    // --- Serial ports ---------------------------------------------------------------------------
    // The USARTs have the first numbers, the ports made of pins follow.

    /// Makes a serial port of two pins, which a program drives by software. It gets the next free number.
    pub fn add_serial_pins(&mut self, pins: SerialPins) {
        self.serial_pins.push(serial_pins::attach(self.cpu, pins));
    }

    /// The counts of USART `number`; `None` if the part has no such USART.
    pub fn usart_counts(&self, number: usize) -> Option<UsartCounts> {
        Some(self.usarts.get(number)?.get().counts())
    }

    /// The counts of a serial port in software; `number` counts these alone, from 0, in the order in which
    /// they were added.
    pub fn serial_pin_counts(&self, number: usize) -> Option<SerialPinCounts> {
        Some(self.serial_pins.get(number)?.get().counts())
    }

    /// Cycles of a frame as USART `number` is set up; `None` while its transmitter is off.
    pub fn usart_frame_cycles(&self, number: usize) -> Option<u64> {
        let usart = self.part.usarts.get(number)?;
        usart.transmitter_is_on(self.cpu).then(|| usart.frame_cycles(self.cpu))
    }

    /// Takes the characters that serial port `number` has sent since the last call. A USART's character
    /// counts as sent once it has begun, one at pins once it has ended.
    pub fn take_sent(&mut self, number: usize) -> Vec<Character> {
        let cpu = self.cpu;
        let sent = match number.checked_sub(self.usarts.len()) {
            None => self
                .usarts
                .get_mut(number)
                .filter(|usart| usart.get().has_sent())
                .map(|usart| usart.with(cpu, Usart::take_sent)),
            Some(number) => {
                let serial = self.serial_pins.get_mut(number).filter(|serial| serial.get().has_sent());
                serial.map(|serial| serial.with(cpu, PinSerial::take_sent))
            }
        };
        let Some(sent) = sent else { return Vec::new() };
        if let Some(tracer) = &mut self.tracer {
            tracer.sent(number, &sent);
        }
        sent
    }

    /// Delivers a character to serial port `number`. A USART receives it at the end of its frame, pins edge
    /// by edge.
    pub fn receive(&mut self, number: usize, character: Character) {
        if let Some(tracer) = &mut self.tracer {
            tracer.receives(number, character);
        }
        self.act_from_outside(|mcu| {
            let cpu = mcu.cpu;
            match number.checked_sub(mcu.usarts.len()) {
                None => mcu.usarts[number].with(cpu, |usart| usart.receive(character)),
                Some(number) => {
                    if let Some(serial) = mcu.serial_pins.get_mut(number) {
                        serial.with(cpu, |serial| serial.receive(character));
                    }
                }
            }
        });
    }

    // --- Two-wire bus ---------------------------------------------------------------------------

    /// Reads the node's state.
    pub(crate) fn twi<R>(&self, look: impl FnOnce(&Twi, Cpu) -> R) -> R {
        look(self.twi.get(), self.cpu)
    }

    /// Takes the number of pulses that the program has given on SCL by its pin.
    pub(crate) fn take_clock_pulses(&mut self) -> u32 {
        let cpu = self.cpu;
        self.wires.as_mut().map_or(0, |wires| wires.with(cpu, Wires::take_pulses))
    }

    /// Joins the pins SCL and SDA to the wires of a bus.
    pub(crate) fn add_wires(&mut self) {
        self.wires = Some(wires::attach(self.cpu));
    }

    /// Shows the program the level of SDA.
    pub(crate) fn set_data_wire(&mut self, level: bool) {
        self.act_from_outside(|mcu| Wires::set_data(mcu.cpu, level));
    }

    /// Lets the bus act on the node.
    pub(crate) fn act_on_twi<R>(&mut self, act: impl FnOnce(&mut Twi, Cpu) -> R) -> R {
        self.act_from_outside(|mcu| {
            let cpu = mcu.cpu;
            mcu.twi.with(cpu, |twi| act(twi, cpu))
        })
    }
}

impl Drop for Mcu {
    fn drop(&mut self) {
        // SAFETY: the devices, dropped after this, use no handle when they are dropped.
        unsafe { self.cpu.destroy() }
    }
}

#[cfg(test)]
mod tests;
