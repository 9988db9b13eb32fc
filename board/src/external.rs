//! An external interrupt: an edge at a pin wakes a task.

use kernel::{Context, Interrupt, MaskedCell, Semaphore};

use crate::interrupts::Serves;
use crate::mcu;

static SIGNAL: MaskedCell<Option<&'static Semaphore>> = MaskedCell::new(None);

/// One external interrupt: on the ATmega128 INT4 at pin PE4, on the ATmega328P and the ATmega1284P INT0 at
/// PD2, on the ATmega2560 INT0 at PD0.
pub struct External(());

impl External {
    pub(crate) const fn new() -> Self {
        External(())
    }

    /// Posts `signal` at each rising edge.
    pub fn start(self, _: impl Serves<External>, context: &mut impl Context, signal: &'static Semaphore) {
        context.mask(|masked| {
            SIGNAL.set(masked, Some(signal));
            mcu::start_external();
        });
    }
}

/// The interrupt at an edge.
#[doc(hidden)]
#[inline(always)]
pub fn edge(interrupt: &mut Interrupt) {
    if let Some(signal) = interrupt.mask(|masked| SIGNAL.get(masked)) {
        signal.post(interrupt);
    }
}
