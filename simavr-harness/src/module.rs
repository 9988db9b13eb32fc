//! One module of the robot: two MCUs joined by a two-wire bus, and six docks.

use std::num::NonZeroU32;
use std::sync::Arc;

use simulation::{Body, Random, fnv_1a};
use tasks::dock::{Dock, DockSet};
use tasks::link::counters::LinkCounters;
use tasks::superbot::{Half, MASTER, SLAVE};
use thiserror::Error;

use crate::Controller;
use crate::body_pins::{self, BodyPins};
use crate::bus::{Bus, BusCounts};
use crate::character::Character;
use crate::counters;
use crate::cpu::News;
use crate::image::Image;
use crate::lockstep;
use crate::mcu::{Mcu, McuError};
use crate::part::{Part, Pin};
use crate::serial_pins::SerialPins;
use crate::trace::{BusSignal, Slice};

/// The programs of a module's MCUs.
#[derive(Clone, Debug)]
pub struct Images {
    pub master: Arc<Image>,
    pub slave: Arc<Image>,
}

impl Images {
    /// Checks that the images have a link at this dock.
    ///
    /// # Errors
    /// They have none; the message says what to do.
    pub fn expect_link(&self, dock: Dock) -> Result<(), NoLink> {
        let (controller, number) = port(dock);
        let image = if controller == Controller::Master { &self.master } else { &self.slave };
        let symbol = counters::LINKS[number];
        image.symbol(symbol).map(|_| ()).ok_or(NoLink { dock, symbol })
    }
}

/// The images do not serve a dock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "the images have no link at {dock:?} (no {symbol}): build newer ones with `./x build`, or use other docks"
)]
pub struct NoLink {
    dock: Dock,
    symbol: &'static str,
}

/// A module.
pub struct Module {
    /// In the order of [`Controller::ALL`].
    mcus: [Mcu; 2],
    bus: Bus,
    body: Body,
    pins: BodyPins,
    /// The cycle at which the body takes its next step.
    body_due: u64,
    quantum: u64,
    powered_up_at: u64,
    is_on: bool,
}

/// An MCU's third serial port: after its two USARTs, the one at [`SERIAL_PINS`].
const PINS: usize = 2;

/// The pins of the third dock of each MCU, as the board description has them.
const SERIAL_PINS: SerialPins =
    SerialPins { receive: Pin { port: 'E', bit: 7 }, transmit: Pin { port: 'E', bit: 5 } };

/// The pin of each MCU that is high while its control of the joints computes, as in the board description.
pub const CONTROL_PROBE: Pin = Pin { port: 'B', bit: 4 };

impl Module {
    /// A module at power-up. The contents of its memories are drawn from `seed`.
    ///
    /// # Errors
    /// An image does not fit its MCU.
    pub fn new(images: &Images, seed: u64) -> Result<Self, McuError> {
        let mcu = |image: &Arc<Image>, part| {
            let seed = Random::of_part(seed, part).next_u64();
            let mut mcu = Mcu::new(Part::ATMEGA128, Arc::clone(image), seed)?;
            mcu.add_serial_pins(SERIAL_PINS);
            mcu.add_wires();
            Ok::<_, McuError>(mcu)
        };
        let mut mcus = [mcu(&images.master, 0)?, mcu(&images.slave, 1)?];
        let (body, mut pins) = (Body::default(), BodyPins::default());
        pins.attach(&body, &mut mcus);
        let bus = Bus::new(mcus.len());
        Ok(Self {
            bus,
            mcus,
            body,
            pins,
            body_due: body_pins::STEP,
            quantum: u64::MAX,
            powered_up_at: 0,
            is_on: true,
        })
    }

    pub fn mcu(&self, controller: Controller) -> &Mcu {
        &self.mcus[controller as usize]
    }

    pub fn mcu_mut(&mut self, controller: Controller) -> &mut Mcu {
        &mut self.mcus[controller as usize]
    }

    /// Sets the cycle at which a module that has not run yet gets its power.
    pub(crate) fn power_up_at(&mut self, cycle: u64) {
        self.powered_up_at = cycle;
        self.body_due = cycle + body_pins::STEP;
        for mcu in &mut self.mcus {
            mcu.power_up_at(cycle);
        }
    }

    /// The cycle at which the module gets its power.
    pub fn powered_up_at(&self) -> u64 {
        self.powered_up_at
    }

    /// Cuts the module's power.
    pub(crate) fn power_down(&mut self) {
        self.is_on = false;
        for mcu in &mut self.mcus {
            mcu.power_down();
        }
    }

    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// The cycle that the MCU that is ahead has come to.
    pub(crate) fn cycle(&self) -> u64 {
        self.mcus.iter().map(Mcu::cycle).max().unwrap_or(0)
    }

    /// The counts of the bus between the MCUs.
    pub fn bus_counts(&self) -> BusCounts {
        self.bus.counts()
    }

    /// Holds SDA of the bus low until there were `clocks` pulses on SCL.
    pub fn hold_data_wire(&mut self, clocks: NonZeroU32) {
        self.bus.hold_data(&mut self.mcus, clocks);
    }

    /// Records the signals on the wires of the bus from now on.
    pub fn trace_bus(&mut self) {
        self.bus.trace();
    }

    /// Ends the recording and returns the signals, in order.
    pub fn take_bus_signals(&mut self) -> Vec<Slice<BusSignal>> {
        self.bus.take_signals()
    }

    /// Sets the longest turn of one MCU, in cycles. It changes the speed only. By default only the bus bounds
    /// a turn.
    pub fn set_quantum(&mut self, cycles: u64) {
        self.quantum = cycles;
    }

    /// The body that the MCUs drive and measure.
    pub fn body(&self) -> &Body {
        &self.body
    }

    pub fn body_mut(&mut self) -> &mut Body {
        &mut self.body
    }

    /// Shows the MCUs the state of the body, before either of them has run, with the noise of its converters.
    pub(crate) fn show_body(&mut self) {
        for mcu in &mut self.mcus {
            mcu.set_analog(|analog| analog.noise = self.body.noise());
        }
        self.pins.show(&self.body, &mut self.mcus);
    }

    /// Whether a dock looks for another, or has moved its latch to an end.
    pub(crate) fn is_docking(&self) -> bool {
        self.body.has_arrived() || !self.looking().is_empty()
    }

    /// The docks that send out light, to look for others.
    pub(crate) fn looking(&self) -> DockSet {
        body_pins::looking(&self.mcus)
    }

    /// The counts of the link at a dock; `None` if the images have none.
    pub fn link_counters(&self, dock: Dock) -> Option<LinkCounters> {
        let (controller, number) = port(dock);
        counters::link(self.mcu(controller), number)
    }

    /// Runs both MCUs up to `cycle`.
    pub fn run_until(&mut self, cycle: u64) {
        while self.body_due <= cycle {
            lockstep::run_until(&mut self.mcus, &mut self.bus, self.body_due, self.quantum);
            self.pins.step(&mut self.body, &mut self.mcus);
            self.body_due += body_pins::STEP;
        }
        lockstep::run_until(&mut self.mcus, &mut self.bus, cycle, self.quantum);
    }

    /// Whether the module has sent something since the last call.
    pub(crate) fn has_sent(&mut self) -> bool {
        self.mcus.each_mut().map(|mcu| mcu.take(News::Sent)).contains(&true)
    }

    /// Takes the characters that the module has sent through a dock since the last call, in order.
    pub(crate) fn take_sent(&mut self, dock: Dock) -> Vec<Character> {
        let (controller, number) = port(dock);
        self.mcu_mut(controller).take_sent(number)
    }

    /// Delivers a character through a dock.
    pub(crate) fn receive(&mut self, dock: Dock, character: Character) {
        let (controller, number) = port(dock);
        self.mcu_mut(controller).receive(number, character);
    }

    /// The shortest frame, in cycles, that a transmitter at a dock is set up for.
    pub(crate) fn shortest_frame(&self) -> Option<u64> {
        let frame = |(controller, number)| self.mcu(controller).usart_frame_cycles(number);
        Dock::ALL.map(port).into_iter().filter_map(frame).min()
    }

    /// A hash of the state of both MCUs.
    pub fn state_hash(&self) -> u64 {
        let hashes = self.mcus.each_ref().map(Mcu::state_hash);
        fnv_1a(hashes.into_iter().flat_map(u64::to_le_bytes))
    }
}

/// The serial port that serves a dock: the MCU, and the port's number there, which is the dock's place on it.
fn port(dock: Dock) -> (Controller, usize) {
    let place = |half: Half| half.docks().into_iter().position(|here| here == dock);
    match place(MASTER) {
        Some(place) => (Controller::Master, place),
        None => (Controller::Slave, place(SLAVE).unwrap_or(PINS)),
    }
}
