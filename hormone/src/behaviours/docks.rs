//! HORMONE's requests to the docks.

use tasks::docking::latch::End;
use tasks::request::Request;

use crate::action::Docking;
use crate::module::Module;

/// The last request of HORMONE to the docks.
pub struct Docks {
    asked: Option<Docking>,
}

impl Docks {
    /// No request has been made yet.
    pub const fn new() -> Self {
        Docks { asked: None }
    }

    /// Requests what the present action wants of a dock: once, when the action begins. A request that finds
    /// no room is repeated at the next call.
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
