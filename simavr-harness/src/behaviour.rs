//! What the behaviours of a running robot do and know, as its images tell: by markers, and in RAM by name.

use hormone::event::Event as Behaviour;
use hormone::status::Status;
use simulation::{Change, Deed, Wiring, WiringError};

use crate::engine::Engine;
use crate::module::{Controller, Module};

impl simulation::Robot for Engine {
    fn wiring(&self) -> &Wiring {
        self.robot().wiring()
    }

    fn now(&self) -> u64 {
        self.cycle()
    }

    fn powered_up_at(&self, module: usize) -> u64 {
        self.robot().module(module).map_or(0, Module::powered_up_at)
    }

    fn is_on(&self, module: usize) -> bool {
        self.robot().module(module).is_some_and(Module::is_on)
    }

    fn change(&mut self, change: &Change) -> Result<(), WiringError> {
        self.robot_mut().change(change)
    }

    fn run_until(&mut self, cycle: u64) {
        Engine::run_until(self, cycle);
    }

    fn take_deeds(&mut self) -> Vec<Deed> {
        let told = self.take_events().into_iter().filter(|told| told.controller == Controller::Master);
        let deed = told.filter_map(|told| {
            let event = Behaviour::from_byte(told.value)?;
            Some(Deed { cycle: told.cycle, module: told.module, event })
        });
        deed.collect()
    }

    fn status(&self, module: usize) -> Option<Status> {
        let bytes = self.robot().module(module)?.mcu(Controller::Master).read_symbol("MODULE_STATUS").ok()?;
        Status::from_bytes(bytes.first_chunk()?)
    }

    fn state_hash(&self) -> u64 {
        self.robot().state_hash()
    }
}
