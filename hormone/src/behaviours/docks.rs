//! HORMONE's requests to the docks.

use tasks::dock::Dock;
use tasks::docking::latch::End;
use tasks::request::Request;

use crate::action::Docking;
use crate::module::Module;

/// What HORMONE wishes of the docks.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    Nothing,
    Docking(Docking),
    /// Searches end: the robot is to stand.
    Stand,
}

/// The last request of HORMONE to the docks.
pub struct Docks {
    asked: Wish,
}

impl Docks {
    /// No request has been made yet.
    pub const fn new() -> Self {
        Docks { asked: Wish::Nothing }
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
