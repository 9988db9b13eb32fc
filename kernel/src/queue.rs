//! Message queues: a list of buffers that tasks wait on.

use crate::arch;
use crate::context::{Context, Task};
use crate::critical::{Masked, MaskedCell};
use crate::pool::{Message, Pooled, Slot};
use crate::proxy::Elapsed;
use crate::semaphore::Semaphore;
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
    /// The last message, if there is a first.
    last: MaskedCell<Option<&'static Slot<T>>>,
    /// A signal for each message, or the tasks that wait for one.
    messages: Semaphore,
    room: u8,
    refused: MaskedCell<u16>,
}

/// The queue is full. Has the message that it refused.
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

    /// Appends `message`, and wakes the first task that waits for one. A task whose wait has timed out counts
    /// as waiting until it runs: there may be a message more than `room` then.
    ///
    /// # Errors
    /// [`Full`] with the message when there is no room; the queue counts it.
    #[inline(always)]
    pub fn send(&self, context: &mut impl Context, message: Message<T>) -> Result<(), Full<T>> {
        self.send_within(|| self.room, context, message)
    }

    /// As [`send`](Self::send), but leaves `places` of the room to other messages: for those that matter
    /// less.
    ///
    /// # Errors
    /// [`Full`] with the message when there is no more room than that; the queue counts it.
    #[inline(always)]
    pub fn send_leaving(
        &self,
        places: u8,
        context: &mut impl Context,
        message: Message<T>,
    ) -> Result<(), Full<T>> {
        let room = self.room.saturating_sub(places);
        self.send_within(|| room, context, message)
    }

    /// Sends `message` if there are fewer than `room`. `room` is evaluated only if no task waits.
    #[inline(always)]
    fn send_within(
        &self,
        room: impl Fn() -> u8,
        context: &mut impl Context,
        message: Message<T>,
    ) -> Result<(), Full<T>> {
        let slot = message.into_slot();
        match context.mask(|masked| self.append(masked, slot, &room)) {
            Some(is_due) => {
                context.reschedule(is_due);
                Ok(())
            }
            None => Err(self.refuse(context, slot)),
        }
    }

    /// Counts a message as refused, and gives it back.
    #[inline(never)]
    fn refuse(&self, context: &mut impl Context, slot: &'static Slot<T>) -> Full<T> {
        context.mask(|masked| self.refused.count(masked));
        // SAFETY: the slot was this message's, and the queue did not take it.
        Full(unsafe { Message::from_slot(slot) })
    }

    /// Appends `slot` and its signal in one critical section, if there is room or a task waits: if the signal
    /// came later, a message sent in between would wait for it. Returns whether another task is the head now;
    /// `None` if there is no room.
    #[inline(always)]
    fn append(&self, masked: &Masked, slot: &'static Slot<T>, room: impl Fn() -> u8) -> Option<bool> {
        let is_awaited = self.messages.word.is_awaited(masked);
        if !is_awaited && !self.messages.word.add_signal(masked, room()) {
            return None;
        }
        slot.link.set(masked, None);
        match self.first.get(masked).and(self.last.get(masked)) {
            Some(last) => last.link.set(masked, Some(slot)),
            None => self.first.set(masked, Some(slot)),
        }
        self.last.set(masked, Some(slot));
        Some(is_awaited && self.messages.word.signal_by_call(masked))
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
        context.mask(|masked| if self.messages.word.take(masked) { self.take(masked) } else { None })
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

impl<T: Pooled> Drop for Queue<T> {
    /// Returns the messages in it to their pool. A static is never dropped.
    fn drop(&mut self) {
        while let Some(message) = arch::critical(|masked| self.take(masked)) {
            drop(message);
        }
    }
}
