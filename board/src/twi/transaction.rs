//! The answers to each status of the two-wire serial interface, for transactions with other devices on the
//! bus. They touch no register.
//!
//! ```text
//!     Waiting ── START ──► Running ── STOP ──► Ended
//!        ▲                    │
//!        └─ arbitration lost ─┘
//! ```
//!
//! A transaction is a sequence of runs: consecutive operations in the same direction. Each run begins with a
//! START and the device's address; the operations within one need neither. An arbitration is lost at the
//! first bit in which two masters differ. Up to there the device has seen nothing but the winner's
//! transaction, so this one can begin again.

use embedded_hal::i2c::ErrorKind::{Bus, NoAcknowledge};
use embedded_hal::i2c::NoAcknowledgeSource::{Address, Data};
use embedded_hal::i2c::{ErrorKind, Operation};

use super::status;

#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
enum State {
    /// A START follows when the bus is free.
    Waiting,
    /// This MCU has the bus.
    Running,
    Ended(Result<(), ErrorKind>),
}

/// The next action of the interface, as a master that has the bus.
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

/// The progress of a transaction. Its operations are kept by the caller that started it.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Transaction {
    state: State,
    /// SLA+W of the device.
    destination: u8,
    /// The index of the operation that is under way.
    operation: usize,
    /// The index of its next byte.
    next: usize,
    /// How many bytes the run still reads. Writes need no look ahead.
    unread: usize,
}

impl Transaction {
    /// A transaction that has ended, before there was any.
    pub const NONE: Transaction = Transaction { state: State::Ended(Ok(())), ..Transaction::new(0) };

    /// A transaction with the device at the 7-bit `address`.
    pub const fn new(address: u8) -> Transaction {
        Transaction { state: State::Waiting, destination: address << 1, operation: 0, next: 0, unread: 0 }
    }

    /// Whether the interface should send a START when the bus is free (TWSTA).
    pub fn wants_start(&self) -> bool {
        self.state == State::Waiting
    }

    /// Its outcome; `None` if it is under way.
    pub fn outcome(&self) -> Option<Result<(), ErrorKind>> {
        match self.state {
            State::Ended(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// Whether this transaction must answer `status`, TWSR without its prescaler bits. It does not answer a
    /// START if a packet waits for one.
    pub fn is_concerned(&self, status: u8, packet_waits: bool) -> bool {
        match self.state {
            State::Waiting => status == status::START && !packet_waits || status == status::BUS_ERROR,
            State::Running => true,
            State::Ended(_) => false,
        }
    }

    /// The answer to a `status` that concerns it; `data` is what TWDR holds.
    ///
    /// `None` if the transaction has lost the bus: then the [packets' engine](super::engine::Engine) answers.
    pub fn answer(&mut self, status: u8, data: u8, operations: &mut [Operation]) -> Option<Step> {
        match status {
            status::START => {
                self.state = State::Running;
                self.operation = 0;
                Some(self.begin_run(operations))
            }
            status::REPEATED_START => Some(self.begin_run(operations)),
            status::ADDRESS_ACKNOWLEDGED | status::DATA_ACKNOWLEDGED => Some(self.send_next(operations)),
            status::READ_ADDRESS_ACKNOWLEDGED => Some(self.read_next()),
            status::DATA_READ => {
                self.store(data, operations);
                Some(self.read_next())
            }
            status::LAST_DATA_READ => {
                self.store(data, operations);
                Some(self.end_reads(operations))
            }
            status::ADDRESS_REFUSED | status::READ_ADDRESS_REFUSED => {
                Some(self.end(Err(NoAcknowledge(Address))))
            }
            status::DATA_REFUSED => Some(self.end(Err(NoAcknowledge(Data)))),
            status::ARBITRATION_LOST
            | status::LOST_AND_ADDRESSED
            | status::LOST_AND_CALLED
            | status::LOST_AND_READ => {
                self.state = State::Waiting;
                None
            }
            _ => {
                self.end(Err(Bus));
                None
            }
        }
    }

    /// Ends it, unless it has ended. Returns whether it was under way.
    pub fn break_off(&mut self) -> bool {
        let is_under_way = self.outcome().is_none();
        if is_under_way {
            self.end(Err(Bus));
        }
        is_under_way
    }

    fn begin_run(&mut self, operations: &[Operation]) -> Step {
        self.next = 0;
        self.unread = 0;
        let rest = operations.get(self.operation..).unwrap_or_default();
        for operation in rest {
            let Operation::Read(buffer) = operation else { break };
            self.unread = self.unread.saturating_add(buffer.len());
        }
        let reads = matches!(rest.first(), Some(Operation::Read(_)));
        Step::Send(self.destination | u8::from(reads))
    }

    fn send_next(&mut self, operations: &[Operation]) -> Step {
        while let Some(Operation::Write(bytes)) = operations.get(self.operation) {
            if let Some(byte) = bytes.get(self.next) {
                self.next += 1;
                return Step::Send(*byte);
            }
            self.begin_operation();
        }
        self.end_run(operations)
    }

    /// A run without bytes still reads one, as the interface can't stop earlier; it is not stored.
    fn read_next(&self) -> Step {
        Step::Read { acknowledges: self.unread > 1 }
    }

    fn store(&mut self, byte: u8, operations: &mut [Operation]) {
        while let Some(Operation::Read(buffer)) = operations.get_mut(self.operation) {
            if let Some(slot) = buffer.get_mut(self.next) {
                *slot = byte;
                self.next += 1;
                self.unread = self.unread.saturating_sub(1);
                return;
            }
            self.begin_operation();
        }
    }

    fn end_reads(&mut self, operations: &[Operation]) -> Step {
        while let Some(Operation::Read(_)) = operations.get(self.operation) {
            self.begin_operation();
        }
        self.end_run(operations)
    }

    fn begin_operation(&mut self) {
        self.operation += 1;
        self.next = 0;
    }

    fn end_run(&mut self, operations: &[Operation]) -> Step {
        if self.operation < operations.len() { Step::RepeatStart } else { self.end(Ok(())) }
    }

    fn end(&mut self, outcome: Result<(), ErrorKind>) -> Step {
        self.state = State::Ended(outcome);
        Step::Stop
    }
}

#[cfg(test)]
mod tests;
