//! Observes the behaviours of a running robot: through the markers that its images write, and through
//! variables in RAM that are found by name.

use hormone::event::Event as Behaviour;
use hormone::status::Status;
use simulation::{
    Angles, BridgeTotals, Change, Event, Face, LinkTotals, MILLISECOND, Motion, Placing, TraceEvent,
    Transcript, Trouble, Wiring, WiringError,
};

use crate::Controller;
use crate::counters;
use crate::engine::Engine;
use crate::mcu::Mcu;
use crate::module::Module;

/// How long after power-up the robot's images begin to hear, in cycles. Orders sent to modules that power up
/// about then showed 2.4 to 2.7 ms; after a reset it is 0.9 ms less.
const START: u64 = 5 * MILLISECOND / 2;

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

    fn start(&self) -> u64 {
        START
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

    fn take_trace_events(&mut self) -> Vec<TraceEvent> {
        let told = self.take_events().into_iter().filter(|told| told.controller == Controller::Master);
        let trace_event = told.filter_map(|told| {
            let event = Behaviour::from_byte(told.value)?;
            Some(TraceEvent { cycle: told.cycle, module: told.module, event })
        });
        trace_event.collect()
    }

    fn take_changes(&mut self) -> Vec<Event> {
        Engine::take_changes(self)
    }

    fn status(&self, module: usize) -> Option<Status> {
        let module = self.robot().module(module)?;
        let master = module.mcu(Controller::Master);
        // Until the program has begun, RAM holds chance values, or the values from before a reset.
        let begins_at = module.powered_up_at().max(master.starts_at()) + START;
        let bytes = master.read_symbol("MODULE_STATUS").ok().filter(|_| begins_at <= self.cycle())?;
        Status::from_bytes(bytes.first_chunk()?)
    }

    fn acceleration(&self, module: usize) -> [f64; 3] {
        self.robot().module(module).map_or([0.0; 3], |module| module.body().acceleration)
    }

    fn angles(&self, module: usize) -> Angles {
        self.robot().module(module).map_or([0.0; 3], |module| module.body().angles())
    }

    fn placing(&self, module: usize) -> Option<Placing> {
        self.robot().placing(module)
    }

    fn lost_frames(&self, from: Face) -> Option<u64> {
        self.robot().link_counts(from).map(|counts| counts.lost_frames)
    }

    fn links(&self) -> LinkTotals {
        let mut totals = LinkTotals::default();
        mcus(self).flat_map(counters::links).for_each(|counters| totals.add(&counters));
        totals
    }

    fn bridges(&self) -> BridgeTotals {
        let mut totals = BridgeTotals::default();
        mcus(self).filter_map(counters::bridge).for_each(|counters| totals.add(&counters));
        totals
    }

    fn transcripts(&self) -> Vec<Transcript> {
        self.robot().transcripts()
    }

    fn crashes(&self) -> Vec<String> {
        let crashes = self.robot().crashes();
        let line = |(module, controller, reason)| {
            format!("module {module}: the {controller:?} MCU crashed: {reason}")
        };
        crashes.map(line).collect()
    }

    fn motion(&self) -> Option<Motion> {
        self.robot().motion()
    }

    fn tilt(&self) -> Option<f64> {
        self.robot().tilt()
    }

    fn charge_used(&self) -> Option<f64> {
        Some(self.robot().charge_used())
    }

    fn trouble(&self) -> Option<&Trouble> {
        self.robot().trouble()
    }

    fn state_hash(&self) -> u64 {
        self.robot().state_hash()
    }
}

/// The MCUs whose programs have slept. Before the first sleep, RAM may still hold its values from power-up.
fn mcus(engine: &Engine) -> impl Iterator<Item = &Mcu> {
    let robot = engine.robot();
    let modules = (0..robot.modules()).filter_map(|module| robot.module(module));
    modules.flat_map(|module| {
        let mcus = Controller::ALL.map(|controller| module.mcu(controller));
        mcus.into_iter().filter(|mcu| mcu.awake_cycles() < mcu.cycle().saturating_sub(module.powered_up_at()))
    })
}
