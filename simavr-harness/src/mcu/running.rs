//! Runs an MCU in turns. A turn executes instructions, then the timers that are due, then accepts an
//! interrupt.

use super::masked::OpenedBy;
use super::{Accepted, Mcu, State};
use crate::cpu::{Core, Vector};
use crate::execution::{self, Watchers};
use crate::marker::Marker;
use crate::repair::{interrupt, sleep};

/// Cycles of a relative jump.
const JUMP: u64 = 2;

impl Mcu {
    /// Runs up to the first instruction boundary at or after `cycle`, or to the program's end.
    /// Asleep, it stops at `cycle` exactly.
    pub fn run_until(&mut self, cycle: u64) {
        while self.run_slice(cycle) {}
    }

    /// Runs for `cycles` at most, until the program writes the marker `value`, which is then the
    /// last one logged. Returns it; `None` if the time passed or the program ended without it.
    pub fn run_to_marker(&mut self, value: u8, cycles: u64) -> Option<Marker> {
        let limit = self.cycle() + cycles;
        self.markers.with(self.cpu, |markers| markers.stop = true);
        let found = loop {
            let seen = self.markers().len();
            let more = self.run_slice(limit);
            let found = self.markers()[seen..].iter().copied().find(|marker| marker.value == value);
            if found.is_some() || !more {
                break found;
            }
        };
        self.markers.with(self.cpu, |markers| markers.stop = false);
        found
    }

    /// Runs up to the first instruction boundary at or after `cycle`, until the program writes a marker,
    /// which is then the last one logged, or until it sleeps or ends. Returns the marker's value.
    pub fn run_to_stop(&mut self, cycle: u64) -> Option<u8> {
        self.markers.with(self.cpu, |markers| markers.stop = true);
        let seen = self.markers().len();
        self.cpu.clear_attention();
        while self.is_alive() && self.cycle() < cycle && self.markers().len() == seen {
            self.turn(cycle);
            if self.cpu.core() == Core::Sleeping {
                break;
            }
        }
        self.markers.with(self.cpu, |markers| markers.stop = false);
        self.markers().get(seen).map(|marker| marker.value)
    }

    /// Runs to the program's end, for `cycles` at most.
    pub fn run_to_end(&mut self, cycles: u64) -> State {
        self.run_until(self.cycle() + cycles);
        self.state()
    }

    /// Executes one instruction. Asleep, passes the time to the next event in the MCU instead, at most 1000
    /// cycles. Accepts an interrupt afterwards if one is pending.
    pub fn step(&mut self) -> Option<Accepted> {
        let limit = match self.cpu.core() {
            Core::Sleeping => self.cycle() + 1000,
            _ => self.cycle() + 1,
        };
        self.turn(limit)
    }

    /// Runs until `cycle`, the program's end or a device's call for attention. Returns whether there
    /// is more to run.
    pub(crate) fn run_slice(&mut self, cycle: u64) -> bool {
        self.cpu.clear_attention();
        while self.is_alive() && self.cycle() < cycle {
            self.turn(cycle);
            if self.cpu.attention() {
                return self.is_alive() && self.cycle() < cycle;
            }
        }
        false
    }

    /// The earliest cycle at which the program can do anything: now, or, asleep, the cycle of the next timer.
    pub(crate) fn earliest_action(&self) -> u64 {
        match self.state() {
            State::Running => self.cycle(),
            State::Sleeping => self.cpu.next_timer().unwrap_or(u64::MAX),
            State::Done | State::Off | State::Crashed(_) => u64::MAX,
        }
    }

    /// One round of the simulation: instructions, then timers, then interrupts.
    fn turn(&mut self, limit: u64) -> Option<Accepted> {
        let start = self.cycle();
        if start < self.starts_at {
            self.cpu.set_cycle(limit.min(self.starts_at));
            self.cpu.process_timers();
            return None;
        }
        if self.cpu.core() == Core::Running {
            // The core runs but was asleep: the interrupt that woke it was withdrawn before it was accepted.
            if let Some(tracer) = self.tracer.as_mut().filter(|_| self.asleep) {
                tracer.wakes(start);
            }
            self.show_debugger();
            let (program, pc) = (self.image.program(), self.pc());
            let watchers = Watchers { coverage: self.image.coverage(), tracer: self.tracer.as_deref_mut() };
            match self.hangs_at {
                None => {
                    // Windows, jobs and the debugger are served after each instruction.
                    let is_recorded =
                        self.windows.is_some() || !self.jobs.is_empty() || self.debugger.is_some();
                    let limit = if is_recorded { start + 1 } else { limit };
                    execution::run(self.cpu, limit, program, watchers);
                }
                Some(address) if address == pc => self.cpu.set_cycle(start + JUMP),
                Some(_) => execution::run(self.cpu, start + 1, program, watchers),
            }
            self.awake_cycles += self.cycle() - start;
            self.asleep = self.cpu.core() == Core::Sleeping;
            if self.asleep && self.part.has_mcucr && self.cpu.interrupts_enabled() {
                sleep::check(self.cpu);
            }
            if let Some(adc) = self.adc.as_mut().filter(|_| self.asleep) {
                adc.with(self.cpu, |adc| adc.sleeps(self.cpu));
            }
        }
        let to_next_timer = self.process_timers();
        self.watch_window();
        self.watch_turn();
        match self.cpu.core() {
            Core::Running => {}
            Core::Sleeping if self.cpu.has_fault() => {} // it crashed as it went to sleep
            Core::Sleeping if self.cpu.interrupts_enabled() => {
                let slept = to_next_timer.min(limit.saturating_sub(self.cycle()));
                self.cpu.set_cycle(self.cycle() + slept);
                // A timer due now has to fire within the turn: an action from outside after it would come
                // first.
                if slept == to_next_timer {
                    self.process_timers();
                }
            }
            Core::Sleeping => self.ended = Some(State::Done),
            Core::Stopped => self.crash(),
        }
        if self.cpu.has_fault() {
            self.crash();
        }
        self.enabled_just_now = self.cpu.enabled_just_now();
        let accepted = self.serve_interrupts();
        // Pushing the return address may have failed for want of a stack.
        if self.ended.is_none() && self.cpu.has_fault() {
            self.crash();
        }
        accepted
    }

    /// Fires the timers that are due, and completes a reset by the watchdog. Returns the cycles to the next
    /// timer.
    fn process_timers(&mut self) -> u64 {
        let before = self.cycle();
        let to_next = self.cpu.process_timers();
        if self.cycle() < before {
            self.complete_reset(before);
            self.open_window(OpenedBy::Start, 0);
            self.drop_turn();
        }
        if let Some(spm) = self.spm.as_ref().filter(|_| self.spm_waits) {
            spm.get().refresh(self.cpu); // a write may have ended
        }
        to_next
    }

    fn crash(&mut self) {
        let reason = self.cpu.fault().unwrap_or_else(|| "the core stopped".to_owned());
        self.ended = Some(State::Crashed(format!("{reason} (pc {:#x})", self.pc())));
    }

    fn serve_interrupts(&mut self) -> Option<Accepted> {
        let vector = self.cpu.serve_interrupts()?;
        if let Some(tracer) = &mut self.tracer {
            tracer.accepted(vector.number(), self.cpu.cycle());
        }
        let woken = std::mem::take(&mut self.asleep);
        let response_cycles =
            self.part.response_cycles() + if woken { self.part.wake_up_cycles() } else { 0 };
        self.cpu.set_cycle(self.cycle() + response_cycles);
        self.awake_cycles += response_cycles;
        self.refresh_level(vector);
        self.open_window(OpenedBy::Interrupt(vector.number()), response_cycles);
        self.pause_turn(response_cycles);
        Some(Accepted { vector: vector.number(), response_cycles })
    }

    /// Makes an accepted interrupt pending again if it is level-triggered and its condition lasts.
    fn refresh_level(&self, vector: Vector) {
        interrupt::refresh(self.cpu, vector);
        if let Some(external) = &self.external {
            external.get().accepted(self.cpu, vector.number());
        }
        if vector.number() == self.part.eeprom.ready {
            self.eeprom.get().refresh(self.cpu);
        }
        let is_spm = self.part.spm.as_ref().is_some_and(|spm| spm.ready == vector.number());
        if let Some(spm) = self.spm.as_ref().filter(|_| is_spm) {
            spm.get().refresh(self.cpu);
        }
    }

    /// Acts on the MCU from outside, between two instructions. An interrupt raised by `act` is accepted at
    /// once, before the next instruction, as one raised inside would be. If the last instruction enabled
    /// interrupts, one more runs first (datasheet, "Reset and Interrupt Handling").
    pub(super) fn act_from_outside<R>(&mut self, act: impl FnOnce(&mut Self) -> R) -> R {
        let waited = self.cpu.interrupt_waits();
        let result = act(self);
        if !waited && !self.enabled_just_now && self.cpu.interrupt_waits() && self.is_alive() {
            self.serve_interrupts();
        }
        result
    }
}
