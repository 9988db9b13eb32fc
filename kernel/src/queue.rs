//! Message queues: a list of buffers that tasks wait on.

use crate::arch;
use crate::context::{Context, Task};
use crate::masked::{Masked, MaskedCell};
use crate::pool::{Message, Pooled, Slot};
use crate::semaphore::{Semaphore, Store};
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
pub struct Queue<T: Pooled> {
    /// The first message, if there is one.
    first: MaskedCell<Option<&'static Slot<T>>>,
    /// The last message, where there is a first.
    last: MaskedCell<Option<&'static Slot<T>>>,
    /// A signal for each message, or the tasks that wait for one.
    messages: Semaphore,
    room: u8,
    refused: MaskedCell<u16>,
}

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
        let store = context.mask(|masked| {
            let store = self.messages.store(masked, self.room);
            if store != Store::Full {
                self.append(masked, slot);
            }
            store
        });
        match store {
            Store::Done => Ok(()),
            Store::Awaited => {
                // In a section of its own, to be short. Should another's message have woken the task meanwhile, this
                // signal is for that.
                self.messages.post(context);
                Ok(())
            }
            Store::Full => {
                context.mask(|masked| self.refused.count(masked));
                // SAFETY: the slot was this message's, and the queue did not take it.
                Err(Full(unsafe { Message::from_slot(slot) }))
            }
        }
    }

    /// Takes the first message, and blocks until there is one.
    #[inline(always)]
    pub fn receive(&self, task: &mut Task) -> Message<T> {
        loop {
            // The signal stood for a message, so there is one.
            if let Some(message) = self.try_receive(task) {
                return message;
            }
            if let Some(task) = self.messages.block(task) {
                arch::switch(task);
            }
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

    #[inline(always)]
    fn append(&self, masked: &Masked, slot: &'static Slot<T>) {
        slot.link.set(masked, None);
        if self.first.get(masked).is_none() {
            self.first.set(masked, Some(slot));
        } else if let Some(last) = self.last.get(masked) {
            last.link.set(masked, Some(slot));
        }
        self.last.set(masked, Some(slot));
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
