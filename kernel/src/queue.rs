//! Message queues: a list of buffers that tasks wait on.

use crate::arch;
use crate::context::{Context, Task};
use crate::masked::{Masked, MaskedCell};
use crate::pool::{Message, Pooled, Slot};
use crate::semaphore::Semaphore;
use crate::timeout::Elapsed;
use crate::timer::Ticks;

/// A queue of up to `room` messages, in order.
///
/// ```
/// use kernel::Queue;
/// struct Reading(u16);
/// kernel::pool!(Reading, 8);
/// static READINGS: Queue<Reading> = Queue::new(4);
/// ```
#[repr(C)]
pub struct Queue<T: Pooled> {
    /// The first message, if there is one.
    pub(crate) first: MaskedCell<Option<&'static Slot<T>>>,
    /// The last message, where there is a first.
    pub(crate) last: MaskedCell<Option<&'static Slot<T>>>,
    /// A signal for each message, or the tasks that wait for one.
    pub(crate) messages: Semaphore,
    pub(crate) room: u8,
    refused: MaskedCell<u16>,
}

/// What came of appending a message. A number, of which the compiler makes less than of an enum.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Appended(pub(crate) u8);

impl Appended {
    /// With its signal: the high byte of a semaphore's word with signals.
    pub(crate) const STORED: Appended = Appended(0);
    /// A task waits for its signal.
    pub(crate) const AWAITED: Appended = Appended(1);
    /// There is no room.
    pub(crate) const NOT: Appended = Appended(2);
}

/// Has the compiler move what follows out of the way.
#[cold]
fn seldom() {}

/// The queue is full. The message comes back.
pub struct Full<T: Pooled>(pub Message<T>);

impl<T: Pooled> Queue<T> {
    /// An empty queue with room for `room` messages, besides those that tasks are waiting for.
    pub const fn new(room: u8) -> Self {
        Queue {
            first: MaskedCell::new(None),
            last: MaskedCell::new(None),
            messages: Semaphore::new(0),
            room,
            refused: MaskedCell::new(0),
        }
    }

    /// Appends `message`, and wakes the first task that waits for one.
    ///
    /// # Errors
    /// [`Full`] with the message when there is no room; the queue counts it.
    pub fn send(&self, context: &mut impl Context, message: Message<T>) -> Result<(), Full<T>> {
        let slot = message.into_slot();
        let appended = context.mask(|masked| arch::append(masked, self, slot));
        if appended == Appended::STORED {
            return Ok(());
        }
        seldom();
        if appended == Appended::AWAITED {
            // In a section of its own, to be short. Should another's message have woken the task meanwhile, this signal is
            // for that.
            self.messages.post(context);
            return Ok(());
        }
        context.mask(|masked| self.refused.count(masked));
        // SAFETY: the slot was this message's, and the queue did not take it.
        Err(Full(unsafe { Message::from_slot(slot) }))
    }

    /// Takes the first message, and blocks until there is one.
    #[inline(always)]
    pub fn receive(&self, task: &mut Task) -> Message<T> {
        loop {
            self.messages.wait(task);
            // The signal stood for a message, so there is one.
            if let Some(message) = task.mask(|masked| self.take(masked)) {
                return message;
            }
        }
    }

    /// Takes the first message, and blocks until there is one, for `ticks` ticks at most; see
    /// [`Semaphore::wait_timeout`].
    ///
    /// # Errors
    /// [`Elapsed`] when the time is up.
    pub fn receive_timeout(&self, task: &mut Task, ticks: Ticks) -> Result<Message<T>, Elapsed> {
        self.messages.wait_timeout(task, ticks)?;
        task.mask(|masked| self.take(masked)).ok_or(Elapsed)
    }

    /// Takes the first message if there is one.
    pub fn try_receive(&self, context: &mut impl Context) -> Option<Message<T>> {
        context.mask(|masked| if self.messages.take(masked) { self.take(masked) } else { None })
    }

    /// How many messages were refused because the queue was full.
    pub fn refused(&self, context: &mut impl Context) -> u16 {
        context.mask(|masked| self.refused.get(masked))
    }

    /// Takes the first message, for which a signal was taken before.
    #[inline(always)]
    fn take(&self, masked: &Masked) -> Option<Message<T>> {
        let slot = self.first.get(masked)?;
        self.first.set(masked, slot.link.get(masked));
        // SAFETY: the slot came from a message, and has just left the queue.
        Some(unsafe { Message::from_slot(slot) })
    }
}
