//! Message queues: a list of buffers that tasks wait on.

use crate::arch;
use crate::context::{Context, Task};
use crate::masked::{Masked, MaskedCell};
use crate::pool::{Message, Pooled, Slot};
use crate::ready;
use crate::task::ControlBlock;
use crate::waiters;

/// A queue of up to `room` messages, in order.
///
/// ```
/// use kernel::Queue;
/// struct Reading(u16);
/// kernel::pool!(Reading, 8);
/// static READINGS: Queue<Reading> = Queue::new(4);
/// ```
pub struct Queue<T: Pooled> {
    first: MaskedCell<Option<&'static Slot<T>>>,
    last: MaskedCell<Option<&'static Slot<T>>>,
    /// Tasks that wait for a message; there are none while there are messages.
    waiting: MaskedCell<Option<&'static ControlBlock>>,
    room: MaskedCell<u8>,
    refused: MaskedCell<u16>,
}

/// The queue is full. The message comes back.
pub struct Full<T: Pooled>(pub Message<T>);

impl<T: Pooled> Queue<T> {
    /// An empty queue with room for `room` messages.
    pub const fn new(room: u8) -> Self {
        Queue {
            first: MaskedCell::new(None),
            last: MaskedCell::new(None),
            waiting: MaskedCell::new(None),
            room: MaskedCell::new(room),
            refused: MaskedCell::new(0),
        }
    }

    /// Appends `message`, and wakes the first task that waits for one.
    ///
    /// # Errors
    /// [`Full`] with the message when there is no room; the queue counts it.
    pub fn send(&self, context: &mut impl Context, message: Message<T>) -> Result<(), Full<T>> {
        let slot = message.into_slot();
        let is_due = context.mask(|masked| self.append(masked, slot));
        match is_due {
            Some(is_due) => {
                context.reschedule(is_due);
                Ok(())
            }
            // SAFETY: the slot was this message's, and the queue did not take it.
            None => Err(Full(unsafe { Message::from_slot(slot) })),
        }
    }

    /// Takes the first message, and blocks until there is one.
    pub fn receive(&self, task: &mut Task) -> Message<T> {
        loop {
            let message = task.mask(|masked| {
                let message = self.take(masked);
                if message.is_none() {
                    let blocked = ready::block(masked);
                    let first = match self.waiting.get(masked) {
                        None => {
                            blocked.set_next(masked, None);
                            blocked
                        }
                        Some(first) => waiters::insert(masked, first, blocked),
                    };
                    self.waiting.set(masked, Some(first));
                }
                message
            });
            match message {
                Some(message) => return message,
                None => arch::switch(),
            }
        }
    }

    /// Takes the first message if there is one.
    pub fn try_receive(&self, context: &mut impl Context) -> Option<Message<T>> {
        context.mask(|masked| self.take(masked))
    }

    /// How many messages were refused because the queue was full.
    pub fn refused(&self, context: &mut impl Context) -> u16 {
        context.mask(|masked| self.refused.get(masked))
    }

    /// `None` when there is no room, else whether a switch is due.
    #[inline]
    fn append(&self, masked: &Masked, slot: &'static Slot<T>) -> Option<bool> {
        let Some(room) = self.room.get(masked).checked_sub(1) else {
            self.refused.count(masked);
            return None;
        };
        self.room.set(masked, room);
        slot.link.set(masked, None);
        match self.last.get(masked) {
            Some(last) => last.link.set(masked, Some(slot)),
            None => self.first.set(masked, Some(slot)),
        }
        self.last.set(masked, Some(slot));
        let Some(waiting) = self.waiting.get(masked) else { return Some(false) };
        self.waiting.set(masked, waiting.next_waiting(masked));
        Some(ready::make_ready(masked, waiting))
    }

    #[inline]
    fn take(&self, masked: &Masked) -> Option<Message<T>> {
        let slot = self.first.get(masked)?;
        let rest = slot.link.get(masked);
        self.first.set(masked, rest);
        if rest.is_none() {
            self.last.set(masked, None);
        }
        self.room.set(masked, self.room.get(masked).wrapping_add(1));
        // SAFETY: the slot came from a message, and has just left the queue.
        Some(unsafe { Message::from_slot(slot) })
    }
}
