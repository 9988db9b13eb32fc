//! embedded-hal's I2C: transactions with other devices on the bus. They take turns with the packets, on the
//! same interface.

use core::ptr;

use embedded_hal::i2c::{self, ErrorKind, Operation};
use kernel::{Context, Interrupt, Masked, Task};

use super::control::{ACKNOWLEDGE, ENABLED, INTERRUPT, START, STOP};
use super::interface;
use super::registers::{data, request, set_bit_rate, set_control, set_data, status};
use super::transaction::{Step, Transaction};
use super::under_way::{IS_ENDED, IS_STARTED, Lent, NO_OPERATIONS, OPERATIONS, TRANSACTION};
use crate::WithTask;
use crate::interrupts::Serves;

/// Other devices on the bus of the two-wire serial interface: SCL = PD0, SDA = PD1.
pub struct I2c(());

impl I2c {
    pub(crate) const fn new() -> Self {
        I2c(())
    }

    /// Starts the interface at [`I2C_HZ`](crate::superbot::I2C_HZ), beside [`Twi`](super::Twi) or without it.
    pub fn start(self, _: impl Serves<I2c>, context: &mut impl Context) -> Master {
        // Without packets TWAR keeps 0x7f, an address that I2C reserves, so no master addresses this MCU.
        set_bit_rate();
        context.mask(|masked| {
            IS_STARTED.set(masked, true);
            request(masked, ENABLED);
        });
        Master(())
    }
}

/// The running interface, as a master of other devices.
pub struct Master(());

impl Master {
    /// This master as an [`embedded_hal::i2c::I2c`].
    ///
    /// ```ignore
    /// master.with(task).write_read(0x48, &[0], &mut buffer)
    /// ```
    pub fn with<'a>(&'a mut self, task: &'a mut Task) -> WithTask<'a, Self> {
        WithTask::new(self, task)
    }
}

impl i2c::ErrorType for WithTask<'_, Master> {
    /// `NoAcknowledge` of the address or of a byte; or `Bus`, also if that error occurred while the
    /// transaction waited for the bus, or if the bus was [freed](tasks::device::Bus::free) for packets: the
    /// bridge does so where one has waited for 5 ms. A lost arbitration is no error: the transaction is tried
    /// again.
    type Error = ErrorKind;
}

impl i2c::I2c for WithTask<'_, Master> {
    /// Blocks until the transaction has ended: forever, if another master never releases the bus.
    ///
    /// A read of no bytes still takes one byte off the bus, and drops it: the interface can't end a read
    /// before. An empty list of operations does nothing on the bus.
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        if operations.is_empty() {
            return Ok(());
        }
        let lent = ptr::slice_from_raw_parts_mut(operations.as_mut_ptr().cast(), operations.len());
        self.task.mask(|masked| {
            OPERATIONS.set(masked, Lent(lent));
            TRANSACTION.set(masked, Transaction::new(address));
            request(masked, START);
        });
        loop {
            IS_ENDED.wait(self.task);
            let outcome = self.task.mask(|masked| TRANSACTION.get(masked).outcome());
            if let Some(outcome) = outcome {
                self.task.mask(|masked| OPERATIONS.set(masked, Lent(NO_OPERATIONS)));
                return outcome;
            }
        }
    }
}

/// The interrupt "Two-wire Serial Interface" in a program with packets and transactions.
#[doc(hidden)]
#[inline(always)]
pub fn status_changed_with_i2c(interrupt: &mut Interrupt) {
    let is_concerned = interrupt.mask(|masked| {
        let packet_waits = interface::engine(masked).wants_start();
        TRANSACTION.get(masked).is_concerned(status(), packet_waits)
    });
    if is_concerned && answer(interrupt) {
        return;
    }
    let transaction_waits = interrupt.mask(|masked| TRANSACTION.get(masked).wants_start());
    interface::settle(interrupt);
    if let Some(signal) = interface::answer(interrupt, status(), transaction_waits) {
        signal.post(interrupt);
    }
}

/// Answers a status that concerns the transaction. Returns whether that was all. If not, the transaction has
/// lost the bus, and the packets' engine must answer, too.
///
/// Not inlined: otherwise packets would pay for the registers that it saves.
#[inline(never)]
fn answer(interrupt: &mut Interrupt) -> bool {
    let (step, has_ended) = interrupt.mask(|masked| {
        let mut transaction = TRANSACTION.get(masked);
        // SAFETY: the task that lent them waits in `transaction`, which takes them back before it returns.
        // While none are lent, the list is empty.
        let operations = unsafe { &mut *OPERATIONS.get(masked).0 };
        let step = transaction.answer(status(), data(), operations);
        TRANSACTION.set(masked, transaction);
        if let Some(step) = step {
            take(masked, step);
        }
        (step, transaction.outcome().is_some())
    });
    if has_ended {
        IS_ENDED.post(interrupt);
    }
    step.is_some()
}

/// Makes the interface take `step`. A packet that waits is sent after the STOP.
#[inline(always)]
fn take(masked: &Masked, step: Step) {
    let engine = interface::engine(masked);
    let acknowledge = if engine.acknowledges() { ACKNOWLEDGE } else { 0 };
    let control = match step {
        Step::Send(byte) => {
            set_data(byte);
            acknowledge
        }
        Step::Read { acknowledges: true } => ACKNOWLEDGE,
        Step::Read { acknowledges: false } => 0,
        Step::RepeatStart => acknowledge | START,
        Step::Stop if engine.wants_start() => acknowledge | STOP | START,
        Step::Stop => acknowledge | STOP,
    };
    set_control(masked, ENABLED | INTERRUPT | control);
}
