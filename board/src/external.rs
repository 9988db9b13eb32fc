//! An external interrupt: an edge at a pin wakes a task.

use avr_device::atmega128a::EXINT;
use kernel::{Context, Interrupt, MaskedCell, Semaphore};

use crate::interrupts::Serves;

static SIGNAL: MaskedCell<Option<&'static Semaphore>> = MaskedCell::new(None);

/// EIMSK: INT4.
const INT4: u8 = 1 << 4;

/// External interrupt INT4, at pin PE4.
pub struct External4(());

impl External4 {
    pub(crate) const fn new() -> Self {
        External4(())
    }

    /// Posts `signal` at each rising edge.
    pub fn start(self, _: impl Serves<External4>, context: &mut impl Context, signal: &'static Semaphore) {
        // SAFETY: there is one `External4`, and it ends here; the bits of other interrupts stay as they are.
        let external = unsafe { EXINT::steal() };
        context.mask(|masked| {
            SIGNAL.set(masked, Some(signal));
            external.eicrb().modify(|_, w| w.isc4().val_0x03());
            external.eifr().write(|w| w.intf().set(INT4)); // an edge from before, or from the change of sense
            external.eimsk().modify(|r, w| w.int().set(r.int().bits() | INT4));
        });
    }
}

/// The interrupt "External Interrupt Request 4".
#[doc(hidden)]
#[inline(always)]
pub fn edge(interrupt: &mut Interrupt) {
    if let Some(signal) = interrupt.mask(|masked| SIGNAL.get(masked)) {
        signal.post(interrupt);
    }
}
