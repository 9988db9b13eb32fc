//! Messages: a pool of buffers, and queues.

use std::mem;

use super::{Activity, Queue, Reference, TaskId};
use crate::call::{BUFFERS, Object, Outcome};

impl Reference {
    /// Takes a buffer. Returns whether there was one.
    pub(super) fn take_buffer(&mut self) -> bool {
        if self.pool.used == BUFFERS {
            self.pool.exhausted = self.pool.exhausted.saturating_add(1);
            return false;
        }
        self.pool.used += 1;
        self.pool.most_used = self.pool.most_used.max(self.pool.used);
        true
    }

    fn first_receiver(&self, from: usize) -> Option<TaskId> {
        self.first_task_in_line(Object::Queue(from))
    }

    pub(super) fn is_full(&self, index: usize) -> bool {
        let queue = &self.queues[index];
        let is_awaited = self.lines.iter().any(|&(object, _)| object == Object::Queue(index));
        queue.messages.len() - queue.promised >= queue.room && !is_awaited
    }

    pub(super) fn count_refused(&mut self, queue: usize) {
        self.queues[queue].refused = self.queues[queue].refused.saturating_add(1);
    }

    /// Appends a message, promised to the task that [`announce`](Self::announce) finds.
    pub(super) fn append(&mut self, queue: usize, value: u8) {
        let queue = &mut self.queues[queue];
        queue.messages.push_back(value);
        queue.promised += 1;
    }

    /// Wakes the first task that waits for a message. If there is none, a promised message becomes free.
    pub(super) fn announce(&mut self, queue: usize) {
        self.pass_over(Object::Queue(queue));
        match self.first_receiver(queue) {
            Some(id) => self.wake(id, Activity::Receiving { queue }),
            None => self.queues[queue].promised -= 1,
        }
    }

    /// Makes a message and sends it.
    pub(super) fn make_and_send(&mut self, queue: usize, value: u8) -> Outcome {
        if !self.take_buffer() {
            return Outcome::Exhausted;
        }
        if self.is_full(queue) {
            self.count_refused(queue);
            self.pool.used -= 1;
            return Outcome::Full;
        }
        self.append(queue, value);
        self.announce(queue);
        Outcome::Nothing
    }

    /// Takes the first message if there is one that is not promised.
    pub(super) fn receive(&mut self, queue: usize) -> Option<u8> {
        let queue = &mut self.queues[queue];
        if queue.has_some() { queue.messages.pop_front() } else { None }
    }

    /// Takes the first message. A promise is for any message, not for a particular one.
    pub(super) fn take_promised(&mut self, id: TaskId, queue: usize) {
        let queue = &mut self.queues[queue];
        queue.promised -= 1;
        let message = queue.messages.pop_front();
        self.tasks[id].received += 1;
        self.tasks[id].activity = Activity::Returning(Outcome::Byte(message));
    }

    /// Drops one of the messages that the task has. Returns whether it had any.
    pub(super) fn drop_message(&mut self, id: TaskId) -> bool {
        let task = &mut self.tasks[id];
        let has_any = task.made.take().is_some()
            || task.received > 0 && {
                task.received -= 1;
                true
            };
        self.pool.used -= usize::from(has_any);
        has_any
    }

    pub(super) fn drop_messages(&mut self, id: TaskId) -> Outcome {
        let task = &mut self.tasks[id];
        self.pool.used -= usize::from(task.made.take().is_some()) + mem::take(&mut task.received);
        Outcome::Nothing
    }
}

impl Queue {
    /// Whether there is a message that is not promised.
    pub(super) fn has_some(&self) -> bool {
        self.messages.len() > self.promised
    }
}
