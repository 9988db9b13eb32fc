//! What a robot can be asked for, whatever simulates it.

use hormone::status::Status;

use crate::deed::Deed;
use crate::wiring::Wiring;

/// A robot that can be run.
pub trait Robot {
    /// How its modules are attached to each other now.
    fn wiring(&self) -> &Wiring;

    /// Cycles since power-up.
    fn now(&self) -> u64;

    /// Runs the robot up to `cycle`.
    fn run_until(&mut self, cycle: u64);

    /// Takes what the behaviours did since the last call, in order.
    fn take_deeds(&mut self) -> Vec<Deed>;

    /// What a module says of itself; `None` while it has not begun.
    fn status(&self, module: usize) -> Option<Status>;

    /// A hash of the whole state: equal runs have equal hashes.
    fn state_hash(&self) -> u64;

    /// Whether a module's view of its neighbours and of its type equals the wiring.
    fn is_right(&self, module: usize) -> bool {
        self.status(module).is_some_and(|status| {
            status.neighbours() == Some(self.wiring().neighbours(module))
                && status.module_type == self.wiring().module_type(module)
        })
    }
}
