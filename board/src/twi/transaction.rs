//! What to answer to each status of the two-wire serial interface, for transactions with other devices on the
//! bus. It touches no register.
//!
//! ```text
//!     Waiting ── START ──► Running ── STOP ──► Ended
//!        ▲                    │
//!        └─ arbitration lost ─┘
//! ```
//!
//! A transaction is a sequence of runs: operations that follow each other and go the same way. Each begins with
//! a START and the device's address; an operation within one begins with neither. An arbitration, if it is
//! lost, is lost at the first byte in which two masters differ. Up to there the device has seen the winner's
//! transaction, and nothing of this one, which therefore begins again.

use embedded_hal::i2c::ErrorKind::{Bus, NoAcknowledge};
use embedded_hal::i2c::NoAcknowledgeSource::{Address, Data};
use embedded_hal::i2c::{ErrorKind, Operation};

use super::status;

#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
enum State {
    /// A START comes when the bus is free.
    Waiting,
    /// This MCU has the bus.
    Running,
    Ended(Result<(), ErrorKind>),
}

/// What the interface does next, as a master that has the bus.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub enum Step {
    Send(u8),
    Read {
        /// Whether another byte follows this one.
        acknowledges: bool,
    },
    RepeatStart,
    Stop,
}

/// How far a transaction has come. Its operations are kept by whoever started it.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Transaction {
    state: State,
    /// SLA+W of the device.
    destination: u8,
    /// The index of the operation that the run begins with.
    run: usize,
    /// How many bytes of the run were sent or read.
    done: usize,
}

impl Transaction {
    /// A transaction that has ended, before there was any.
    pub const NONE: Transaction = Transaction { state: State::Ended(Ok(())), ..Transaction::new(0) };

    /// A transaction with the device at the 7-bit `address`.
    pub const fn new(address: u8) -> Transaction {
        Transaction { state: State::Waiting, destination: address << 1, run: 0, done: 0 }
    }

    /// Whether the interface should send a START when the bus is free (TWSTA).
    pub fn wants_start(&self) -> bool {
        self.state == State::Waiting
    }

    /// How it ended; `None` if it is under way.
    pub fn outcome(&self) -> Option<Result<(), ErrorKind>> {
        match self.state {
            State::Ended(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// The answer to `status`, TWSR without its prescaler bits; `None` if that is the
    /// [packets' engine's](super::engine::Engine) to answer, with this transaction no longer on the bus.
    ///
    /// A START is for the packet, if one waits. `data` is what TWDR holds.
    pub fn answer(
        &mut self,
        status: u8,
        packet_waits: bool,
        data: u8,
        operations: &mut [Operation],
    ) -> Option<Step> {
        match (self.state, status) {
            (State::Waiting, status::START) if !packet_waits => {
                self.state = State::Running;
                self.run = 0;
                Some(self.begin_run(operations))
            }
            (State::Waiting | State::Running, status::BUS_ERROR) => {
                self.state = State::Ended(Err(Bus));
                None
            }
            (
                State::Running,
                status::ARBITRATION_LOST
                | status::LOST_AND_ADDRESSED
                | status::LOST_AND_CALLED
                | status::LOST_AND_READ,
            ) => {
                self.state = State::Waiting;
                None
            }
            (State::Running, _) => Some(self.go_on(status, data, operations)),
            _ => None,
        }
    }

    fn go_on(&mut self, status: u8, data: u8, operations: &mut [Operation]) -> Step {
        match status {
            status::REPEATED_START => self.begin_run(operations),
            status::ADDRESS_ACKNOWLEDGED | status::DATA_ACKNOWLEDGED => self.send_next(operations),
            status::READ_ADDRESS_ACKNOWLEDGED => self.read_next(operations),
            status::DATA_READ => {
                self.store(data, operations);
                self.read_next(operations)
            }
            status::LAST_DATA_READ => {
                self.store(data, operations);
                self.end_run(operations)
            }
            status::ADDRESS_REFUSED | status::READ_ADDRESS_REFUSED => self.end(Err(NoAcknowledge(Address))),
            status::DATA_REFUSED => self.end(Err(NoAcknowledge(Data))),
            _ => self.end(Err(Bus)),
        }
    }

    fn begin_run(&mut self, operations: &[Operation]) -> Step {
        self.done = 0;
        let reads = matches!(operations.get(self.run), Some(Operation::Read(_)));
        Step::Send(self.destination | u8::from(reads))
    }

    fn send_next(&mut self, operations: &mut [Operation]) -> Step {
        let Some(byte) = writes(operations, self.run).flatten().nth(self.done).copied() else {
            return self.end_run(operations);
        };
        self.done += 1;
        Step::Send(byte)
    }

    /// A run without bytes reads one all the same, as the interface can't stop earlier; nobody stores it.
    fn read_next(&self, operations: &mut [Operation]) -> Step {
        let length = reads(operations, self.run).fold(0, |length: usize, buffer| length.saturating_add(buffer.len()));
        Step::Read { acknowledges: length.saturating_sub(self.done) > 1 }
    }

    fn store(&mut self, byte: u8, operations: &mut [Operation]) {
        if let Some(slot) = reads(operations, self.run).flatten().nth(self.done) {
            *slot = byte;
            self.done += 1;
        }
    }

    fn end_run(&mut self, operations: &mut [Operation]) -> Step {
        self.run += writes(operations, self.run).count().max(reads(operations, self.run).count());
        if self.run < operations.len() { Step::RepeatStart } else { self.end(Ok(())) }
    }

    fn end(&mut self, outcome: Result<(), ErrorKind>) -> Step {
        self.state = State::Ended(outcome);
        Step::Stop
    }
}

/// What the run that begins with operation `first` writes; nothing if it reads.
fn writes<'a>(operations: &'a [Operation], first: usize) -> impl Iterator<Item = &'a [u8]> {
    operations.get(first..).unwrap_or_default().iter().map_while(|operation| match operation {
        Operation::Write(bytes) => Some(*bytes),
        Operation::Read(_) => None,
    })
}

/// Where the run that begins with operation `first` reads to; nothing if it writes.
fn reads<'a>(operations: &'a mut [Operation], first: usize) -> impl Iterator<Item = &'a mut [u8]> {
    operations.get_mut(first..).unwrap_or_default().iter_mut().map_while(|operation| match operation {
        Operation::Read(buffer) => Some(&mut **buffer),
        Operation::Write(_) => None,
    })
}

#[cfg(test)]
mod tests;
