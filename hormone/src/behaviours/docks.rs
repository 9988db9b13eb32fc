//! What HORMONE asks of the docks.

use tasks::docking::latch::End;
use tasks::request::Request;

use crate::action::Docking;
use crate::module::Module;

/// What the docks were asked for last.
pub struct Docks {
    asked: Option<Docking>,
}

impl Docks {
    /// No dock was asked for anything.
    pub const fn new() -> Self {
        Docks { asked: None }
    }

    /// Asks for what the present action wants of a dock: once, when the action begins. What finds no room is
    /// asked for the next time.
    #[inline(never)] // else its message would lie under those that HORMONE sends
    pub fn ask(&mut self, wanted: Option<Docking>, module: &mut impl Module) {
        if wanted == self.asked {
            return;
        }
        let is_asked = match wanted.map(request) {
            Some(request) => module.request(request).is_ok(),
            None => true,
        };
        if is_asked {
            self.asked = wanted;
        }
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
