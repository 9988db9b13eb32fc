//! Bytes: a FIFO, and a pipe on which tasks wait.

use std::collections::VecDeque;
use std::ops::ControlFlow::{self, Break, Continue};

use super::{Activity, Reference, TaskId};
use crate::call::{Call, FIFO_BYTES, Object, Outcome, PIPE_BYTES};

#[derive(Clone, PartialEq)]
pub struct Fifo {
    bytes: VecDeque<u8>,
    room: usize,
    overruns: u16,
}

#[derive(Clone, PartialEq)]
pub struct Pipe {
    fifo: Fifo,
    /// Bytes that are promised to no task.
    pub(super) bytes: u8,
    /// Places that are promised to no task.
    pub(super) space: u8,
}

/// The next step of a call that moves a byte through the pipe.
#[derive(Clone, Copy, PartialEq)]
pub enum Motion {
    TryPut(u8),
    CountOverrun,
    /// Fill the promised place. In the end the call returns this outcome.
    Fill(u8, Outcome),
    AnnounceByte(Outcome),
    TryTake,
    /// Take bytes as long as there are some.
    Flush,
    /// Take the promised byte, and with `flushes` the others, too.
    Drain {
        flushes: bool,
    },
    AnnounceSpace {
        byte: Option<u8>,
        flushes: bool,
    },
}

impl Fifo {
    fn new(room: usize) -> Self {
        Fifo { bytes: VecDeque::new(), room, overruns: 0 }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    fn space(&self) -> usize {
        self.room - self.bytes.len()
    }

    /// Puts a byte in. Returns the space that is left.
    fn put(&mut self, byte: u8) -> Option<u8> {
        if self.space() == 0 {
            self.count_overrun();
            return None;
        }
        self.bytes.push_back(byte);
        Some(self.space() as u8)
    }

    fn count_overrun(&mut self) {
        self.overruns = self.overruns.saturating_add(1);
    }
}

impl Pipe {
    pub(super) fn new() -> Self {
        Pipe { fifo: Fifo::new(PIPE_BYTES), bytes: 0, space: PIPE_BYTES as u8 }
    }
}

impl Motion {
    /// The first step of `call`, if it tries to move a byte.
    pub(super) fn begun_by(call: Call) -> Option<Motion> {
        match call {
            Call::PipeTryPut(byte) => Some(Motion::TryPut(byte)),
            Call::PipeTryTake => Some(Motion::TryTake),
            Call::PipeFlush => Some(Motion::Flush),
            _ => None,
        }
    }
}

impl Reference {
    pub(super) fn new_fifo() -> Fifo {
        Fifo::new(FIFO_BYTES)
    }

    /// A call that moves no byte through the pipe.
    pub(super) fn call_for_bytes(&mut self, call: Call) -> Outcome {
        match call {
            Call::FifoPut(byte) => self.fifo.put(byte).into(),
            Call::FifoTake => self.fifo.bytes.pop_front().into(),
            Call::FifoPeek => self.fifo.bytes.front().copied().into(),
            Call::FifoLength => (self.fifo.bytes.len() as u16).into(),
            Call::FifoSpace => (self.fifo.space() as u16).into(),
            Call::FifoFlush => self.fifo.bytes.clear().into(),
            Call::FifoOverruns => self.fifo.overruns.into(),
            Call::PipePeek => self.pipe.fifo.bytes.front().copied().into(),
            Call::PipeLength => (self.pipe.fifo.bytes.len() as u16).into(),
            Call::PipeSpace => (self.pipe.fifo.space() as u16).into(),
            Call::PipeOverruns => self.pipe.fifo.overruns.into(),
            _ => unreachable!("{call:?} is not for bytes"),
        }
    }

    /// Makes the next step of `id`.
    pub(super) fn go_on_with_motion(&mut self, id: TaskId, motion: Motion) {
        self.tasks[id].activity = match self.step_of(motion) {
            Continue(motion) => Activity::Moving(motion),
            Break(outcome) => Activity::Returning(outcome),
        };
    }

    /// Makes all steps at once, as in an interrupt.
    pub(super) fn move_at_once(&mut self, mut motion: Motion) -> Outcome {
        loop {
            match self.step_of(motion) {
                Continue(next) => motion = next,
                Break(outcome) => return outcome,
            }
        }
    }

    fn step_of(&mut self, motion: Motion) -> ControlFlow<Outcome, Motion> {
        match motion {
            Motion::TryPut(byte) => Continue(match self.take_signal(Object::Space) {
                true => Motion::Fill(byte, Outcome::Truth(true)),
                false => Motion::CountOverrun,
            }),
            Motion::CountOverrun => {
                self.pipe.fifo.count_overrun();
                Break(Outcome::Truth(false))
            }
            Motion::Fill(byte, outcome) => {
                self.pipe.fifo.put(byte).expect("a place was promised");
                Continue(Motion::AnnounceByte(outcome))
            }
            Motion::AnnounceByte(outcome) => {
                self.signal(Object::Byte);
                Break(outcome)
            }
            Motion::TryTake | Motion::Flush => {
                let flushes = motion == Motion::Flush;
                match self.take_signal(Object::Byte) {
                    true => Continue(Motion::Drain { flushes }),
                    false if flushes => Break(Outcome::Nothing),
                    false => Break(Outcome::Byte(None)),
                }
            }
            Motion::Drain { flushes } => {
                let byte = self.pipe.fifo.bytes.pop_front();
                Continue(Motion::AnnounceSpace { byte, flushes })
            }
            Motion::AnnounceSpace { byte, flushes } => {
                self.signal(Object::Space);
                if flushes { Continue(Motion::Flush) } else { Break(Outcome::Byte(byte)) }
            }
        }
    }
}
