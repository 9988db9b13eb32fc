//! HORMONE's requests to the docks, and whether a latch that has closed holds a neighbour.

use tasks::dock::Dock;
use tasks::docking::latch::End;
use tasks::request::Request;

use crate::action::Docking;
use crate::module::Module;
use crate::neighbours::NO_NEIGHBOUR;
use crate::time::{reached, until};

/// What HORMONE wishes of the docks.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    Nothing,
    Docking(Docking),
    /// Searches end: the robot is to stand.
    Stand,
}

/// Hooks that have taken hold of a dock show a neighbour there within this time, in milliseconds, also where
/// the link loses most of its frames.
pub const HOLDS_WITHIN: u16 = 500;

/// The last request of HORMONE to the docks, and the latch that has closed last.
pub struct Docks {
    asked: Wish,
    /// A dock whose latch has closed, and when it has to have a neighbour.
    closed: Option<(Dock, u16)>,
}

impl Docks {
    /// No request has been made yet.
    pub const fn new() -> Self {
        Docks { asked: Wish::Nothing, closed: None }
    }

    /// Requests what HORMONE wishes: once, when the wish begins. Returns whether there was room; else it is
    /// requested at the next call.
    #[inline(never)] // else its message would lie under those that HORMONE sends
    pub fn ask(&mut self, wish: Wish, module: &mut impl Module) -> bool {
        if wish == self.asked {
            return true;
        }
        let is_asked = match wish {
            Wish::Nothing => true,
            Wish::Docking(docking) => module.request(request(docking)).is_ok(),
            // One dock of each MCU.
            Wish::Stand => {
                module.request(Request::Leave(Dock::Front)).is_ok()
                    && module.request(Request::Leave(Dock::Back)).is_ok()
            }
        };
        if is_asked {
            self.asked = wish;
        }
        is_asked
    }

    /// The latch of `dock` has closed.
    pub fn latched(&mut self, now: u16, dock: Dock) {
        self.closed = Some((dock, now.wrapping_add(HOLDS_WITHIN)));
    }

    /// Opens the latch that has closed last if its hooks have missed: they hold no neighbour by now. Another
    /// dock that misses, too, would take this one for its neighbour. Returns whether there was room; else it
    /// is opened at the next call.
    #[inline(never)] // as `ask`
    pub fn open_missed(&mut self, now: u16, neighbours: &[u8; 6], module: &mut impl Module) -> bool {
        let Some((dock, _)) = self.closed.filter(|(_, due)| reached(*due, now)) else { return true };
        let is_held = neighbours[usize::from(dock.index())] != NO_NEIGHBOUR;
        if !is_held && module.request(request(Docking::Release(dock))).is_err() {
            return false;
        }
        self.closed = None;
        true
    }

    /// Milliseconds until the latch that has closed last has to hold a neighbour.
    pub fn holds_in(&self, now: u16) -> Option<u16> {
        self.closed.map(|(_, due)| until(due, now))
    }
}

impl Default for Docks {
    fn default() -> Self {
        Self::new()
    }
}

fn request(docking: Docking) -> Request {
    match docking {
        Docking::Approach(dock) => Request::Approach(dock),
        Docking::Release(dock) => Request::Latch(dock, End::Released),
    }
}
