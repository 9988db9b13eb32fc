//! A chain of modules that run the robot's own images, observed from outside.

use std::mem::offset_of;

use hormone::event::Event as Behaviour;
use hormone::module_type::ModuleType;
use hormone::status::Status;
use simavr_harness::{Controller, Engine, Face, Faults, Reset, Robot, RobotBuilder};
use tasks::dock::Dock;
use tasks::link::counters::LinkCounters;

use crate::firmware;

/// A count that every link keeps, by its offset in [`LinkCounters`].
#[derive(Clone, Copy)]
pub struct Count(usize);

impl Count {
    pub const RETRIES: Count = Count(offset_of!(LinkCounters, retries));
    pub const DUPLICATES: Count = Count(offset_of!(LinkCounters, duplicates));
    pub const GAVE_UP: Count = Count(offset_of!(LinkCounters, gave_up));
}

/// An event of a behaviour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceEvent {
    pub cycle: u64,
    pub module: usize,
    pub event: Behaviour,
}

/// A running chain.
pub struct Chain {
    engine: Engine,
}

impl Chain {
    /// A chain at power-up, run by one thread.
    pub fn new(modules: usize, seed: u64) -> Self {
        Self::on_threads(modules, seed, 1)
    }

    /// A chain at power-up, run by so many threads.
    pub fn on_threads(modules: usize, seed: u64, threads: usize) -> Self {
        let robot = RobotBuilder::chain(firmware(), modules).seed(seed).build();
        Self::of_robot(robot.expect("a chain can be built"), threads)
    }

    /// The chain of a robot that was changed before its run.
    pub fn of_robot(robot: Robot, threads: usize) -> Self {
        Chain { engine: Engine::new(robot, threads) }
    }

    pub fn robot(&self) -> &Robot {
        self.engine.robot()
    }

    /// Cycles since power-up.
    pub fn cycle(&self) -> u64 {
        self.engine.cycle()
    }

    /// Runs for `cycles`, and returns the events of behaviours, in order.
    pub fn run(&mut self, cycles: u64) -> Vec<TraceEvent> {
        self.engine.run_until(self.engine.cycle() + cycles);
        let told = self.engine.take_events().into_iter().filter_map(|told| {
            let event = Behaviour::from_byte(told.value)?;
            Some(TraceEvent { cycle: told.cycle, module: told.module, event })
        });
        told.collect()
    }

    /// Loses frames on every link in both directions with this probability.
    pub fn lose_frames(&mut self, probability: f64) {
        for face in self.links() {
            self.set_faults(face, Faults { frame_loss: probability, ..Faults::default() });
        }
    }

    /// Sets the faults of frames from this dock to the one that it is attached to.
    pub fn set_faults(&mut self, from: Face, faults: Faults) {
        assert!(self.engine.robot_mut().set_faults(from, faults), "{from:?} is attached to nothing");
    }

    /// Pulls an MCU's RESET pin low for a moment.
    pub fn reset(&mut self, module: usize, controller: Controller) {
        let module = self.engine.robot_mut().module_mut(module).expect("the module is there");
        module.mcu_mut(controller).reset(Reset::External);
    }

    /// Keeps MCUs of a module in reset for `cycles`.
    ///
    /// They are reset again and again before their start-up code reaches `main`: it needs far longer to clear
    /// SRAM.
    pub fn hold_in_reset(&mut self, module: usize, mcus: &[Controller], cycles: u64) {
        const STEP: u64 = 1000;
        for _ in 0..cycles / STEP {
            for &mcu in mcus {
                self.reset(module, mcu);
            }
            self.run(STEP);
        }
    }

    /// A module's own status.
    pub fn status(&self, module: usize) -> Option<Status> {
        simulation::Robot::status(&self.engine, module)
    }

    /// The modules whose view of their neighbours or type differs from the wiring.
    pub fn mistaken(&self) -> Vec<(usize, Option<Status>)> {
        let is_right = |module: usize| {
            let wiring = Dock::ALL.map(|dock| Some(self.robot().neighbour(Face { module, dock })?.dock));
            self.status(module).is_some_and(|status| {
                status.neighbours() == Some(wiring) && status.module_type == ModuleType::of(&wiring)
            })
        };
        let mistaken = (0..self.robot().modules()).filter(|&module| !is_right(module));
        mistaken.map(|module| (module, self.status(module))).collect()
    }

    /// The count of the link at a dock of a chain, Front or Back, since its MCU started.
    pub fn count(&self, at: Face, Count(offset): Count) -> u16 {
        let controller = match at.dock {
            Dock::Front => Controller::Master,
            Dock::Back => Controller::Slave,
            _ => panic!("{at:?} is no dock of a chain"),
        };
        let module = self.robot().module(at.module).expect("the module is there");
        let port = module.mcu(controller).read_symbol("LINK_USART0").expect("the image has the symbol");
        u16::from_le_bytes([port[offset], port[offset + 1]])
    }

    /// The sum of a count over all links of the chain.
    pub fn sum(&self, count: Count) -> u64 {
        self.links().into_iter().map(|face| u64::from(self.count(face, count))).sum()
    }

    /// All docks that are attached to another one.
    fn links(&self) -> Vec<Face> {
        let modules = 0..self.robot().modules();
        let faces = modules.flat_map(|module| Dock::ALL.map(|dock| Face { module, dock }));
        faces.filter(|&face| self.robot().neighbour(face).is_some()).collect()
    }

    /// # Panics
    /// When a program has crashed.
    pub fn assert_alive(&self) {
        let crashes: Vec<_> = self.robot().crashes().collect();
        assert!(crashes.is_empty(), "{crashes:?}");
    }

    /// # Panics
    /// When a program has crashed, or a module's view of its neighbours or its type is not as wired.
    pub fn assert_right(&self, when: &str) {
        self.assert_alive();
        let mistaken = self.mistaken();
        assert!(mistaken.is_empty(), "{when}: {mistaken:?}");
    }
}
