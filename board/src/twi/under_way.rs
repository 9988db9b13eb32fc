//! The transaction that is under way, or waits for the bus: what its task, the interrupt, and whoever frees
//! the bus share.

use core::ptr::{self, NonNull};

use embedded_hal::i2c::Operation;
use kernel::{Masked, MaskedCell, Semaphore, Task};

use super::transaction::Transaction;

/// Which byte or condition of it is next.
pub(super) static TRANSACTION: MaskedCell<Transaction> = MaskedCell::new(Transaction::NONE);
/// Lent by the task that waits for the end of its transaction; none at other times.
pub(super) static OPERATIONS: MaskedCell<Lent> = MaskedCell::new(Lent(NO_OPERATIONS));
/// Posted when it has ended.
pub(super) static IS_ENDED: Semaphore = Semaphore::new(0);

/// Whether the program has started [`I2c`](super::I2c). In one that never does, the compiler leaves nothing
/// of transactions.
pub(super) static IS_STARTED: MaskedCell<bool> = MaskedCell::new(false);

/// The operations of a transaction.
#[derive(Clone, Copy)]
pub(super) struct Lent(pub *mut [Operation<'static>]);

// SAFETY: the task that lends them waits until its transaction ends. If it is killed meanwhile, they stay on
// its stack, which stays as it is. Only the interrupt handler uses them meanwhile.
unsafe impl Send for Lent {}

pub(super) const NO_OPERATIONS: *mut [Operation<'static>] =
    ptr::slice_from_raw_parts_mut(NonNull::dangling().as_ptr(), 0);

/// The bus was freed: ends a transaction that is under way or waits. Returns whether there was one; then its
/// task is to be [woken](wake).
pub(super) fn break_off(masked: &Masked) -> bool {
    IS_STARTED.get(masked) && {
        let mut transaction = TRANSACTION.get(masked);
        let is_under_way = transaction.break_off();
        TRANSACTION.set(masked, transaction);
        is_under_way
    }
}

/// Wakes the task whose transaction has ended.
pub(super) fn wake(task: &mut Task) {
    IS_ENDED.post(task);
}
