//! One MCU's two-wire interface (chapter "Two-wire Serial Interface"), in place of simavr's: the
//! registers, and what the program asked for through them. The [`Bus`](crate::bus::Bus) that joins such
//! nodes models the wires.
//!
//! simavr's own interface does not suffice: two of them do not hear each other, the address mask comes from
//! a CPU register, and there are neither general calls nor clock stretching.

use crate::cpu::{Cpu, News, Vector};
use crate::device::{Attached, Device, make_plain};
use crate::part::TwiRegisters;
use crate::repair::interrupt;

// TWCR
const TWINT: u8 = 0x80;
const TWEA: u8 = 0x40;
const TWSTA: u8 = 0x20;
const TWSTO: u8 = 0x10;
const TWWC: u8 = 0x08;
const TWEN: u8 = 0x04;
const TWIE: u8 = 0x01;

/// TWSR without its prescaler bits.
const STATUS: u8 = 0xf8;
/// The status between two events.
const NO_STATUS: u8 = 0xf8;

/// Bits of a byte on the bus: eight of data and the acknowledgement.
pub(crate) const BYTE_BITS: u64 = 9;

/// Bits from a request for a START on a free bus to the first event at another node.
pub(crate) const START_AND_ADDRESS_BITS: u64 = 1 + BYTE_BITS;

/// A node of a two-wire bus.
pub(crate) struct Twi {
    registers: &'static TwiRegisters,
    vector: Vector,
    /// The node holds the clock low until the program clears TWINT.
    holds_clock: bool,
    /// Cycle at which the program last released the clock.
    released_at: u64,
    /// The value of TWCR that released it.
    command: u8,
    /// Length of a bit in cycles when the program last released the clock.
    bit: u64,
    /// Cycle at which the present request for a START took effect.
    start_asked_at: u64,
    /// Length of a bit in cycles then.
    start_bit: u64,
    /// Length of a bit before the program made it shorter, and the cycle up to which that length is used.
    longer_bit: (u64, u64),
    /// Cycle at which the interface was switched off or reset, if the bus has yet to notice. Until it does,
    /// the node holds the clock if it did.
    left_at: Option<u64>,
    /// Cycle at which the program wrote TWSTO, if the bus has yet to notice. A node that is not master gives
    /// up the role of an addressed slave by it.
    stopped_at: Option<u64>,
}

/// What the program wants of the bus next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    /// Go on with the next byte.
    Byte,
    RepeatedStart,
    Stop,
}

/// Replaces simavr's interface by the harness's. `None`: the part has no such vector.
pub(crate) fn attach(cpu: Cpu, registers: &'static TwiRegisters) -> Option<Attached<Twi>> {
    let &TwiRegisters { twbr, twsr, twar, twdr, twcr, vector } = registers;
    make_plain(cpu, &[twbr, twsr, twar, twdr, twcr]);
    let node = Twi {
        registers,
        vector: cpu.vector(vector)?,
        holds_clock: false,
        released_at: 0,
        command: 0,
        bit: u64::MAX,
        start_asked_at: 0,
        start_bit: u64::MAX,
        longer_bit: (0, 0),
        left_at: None,
        stopped_at: None,
    };
    Some(Attached::new(cpu, node, &[twbr, twsr, twdr, twcr], &[]))
}

impl Twi {
    /// Sets the registers to their values after a reset and leaves the bus.
    pub fn reset(&mut self, cpu: Cpu) {
        self.set_rate(cpu, self.registers.twbr, 0);
        self.set_rate(cpu, self.registers.twsr, NO_STATUS);
        cpu.set_data(self.registers.twar, 0xfe);
        cpu.set_data(self.registers.twdr, 0xff);
        cpu.set_data(self.registers.twcr, 0);
        self.leave(cpu);
    }

    fn leave(&mut self, cpu: Cpu) {
        cpu.tell(News::Bus);
        self.left_at = Some(cpu.cycle());
        self.stopped_at = None;
        interrupt::refresh(cpu, self.vector);
        cpu.call_attention();
    }

    fn release_clock(&mut self, at: u64) {
        if std::mem::take(&mut self.holds_clock) {
            self.released_at = at;
        }
    }

    fn control(&self, cpu: Cpu) -> u8 {
        cpu.data(self.registers.twcr)
    }

    // --- What the bus reads ---------------------------------------------------------------------

    /// Whether the node holds the clock low: its program has yet to answer the last event.
    pub fn holds_clock(&self) -> bool {
        self.holds_clock
    }

    pub fn released_at(&self) -> u64 {
        self.released_at
    }

    /// Cycle since which the node waits to send a START.
    pub fn start_asked_at(&self, cpu: Cpu) -> Option<u64> {
        let asks = self.control(cpu) & (TWINT | TWEN | TWSTA) == TWEN | TWSTA;
        asks.then_some(self.start_asked_at)
    }

    pub fn acknowledges(&self, cpu: Cpu) -> bool {
        self.control(cpu) & (TWEA | TWEN) == TWEA | TWEN
    }

    /// The 7-bit address to which the node answers.
    pub fn own_address(&self, cpu: Cpu) -> u8 {
        cpu.data(self.registers.twar) >> 1
    }

    pub fn answers_general_call(&self, cpu: Cpu) -> bool {
        cpu.data(self.registers.twar) & 1 != 0
    }

    /// The byte that the node sends.
    pub fn data(&self, cpu: Cpu) -> u8 {
        cpu.data(self.registers.twdr)
    }

    pub fn command(&self) -> Command {
        if self.command & TWSTO != 0 {
            Command::Stop
        } else if self.command & TWSTA != 0 {
            Command::RepeatedStart
        } else {
            Command::Byte
        }
    }

    /// Length of a bit in cycles when this node generates the clock (section "Bit Rate Generator Unit").
    fn bit_cycles(&self, cpu: Cpu) -> u64 {
        let prescaler = 1 << (2 * (cpu.data(self.registers.twsr) & 3));
        16 + 2 * u64::from(cpu.data(self.registers.twbr)) * prescaler
    }

    /// Length of a bit in cycles as the node's command has it.
    pub fn bit(&self) -> u64 {
        self.bit
    }

    /// Length of a bit in cycles of the START that the node asks for.
    pub fn start_bit(&self) -> u64 {
        self.start_bit
    }

    /// Length of the shortest bit in cycles that the node may generate from now on.
    pub fn shortest_bit(&self, cpu: Cpu) -> u64 {
        self.bit.min(self.start_bit).min(self.bit_cycles(cpu))
    }

    /// Cycle at which the node left the bus, if the bus has yet to notice.
    pub fn left_at(&self) -> Option<u64> {
        self.left_at
    }

    /// Cycle at which the program wrote TWSTO, if the bus has yet to notice.
    pub fn stopped_at(&self) -> Option<u64> {
        self.stopped_at
    }

    // --- What the bus tells ---------------------------------------------------------------------

    /// A byte has come in.
    pub fn receive(&mut self, cpu: Cpu, value: u8) {
        cpu.set_data(self.registers.twdr, value);
    }

    /// Reports an event to the program: sets the status and TWINT.
    pub fn report(&mut self, cpu: Cpu, status: u8) {
        self.set_status(cpu, status);
        cpu.set_bits(self.registers.twcr, TWINT, true);
        self.holds_clock = true;
        interrupt::refresh(cpu, self.vector);
    }

    /// The STOP that the program asked for has been sent.
    pub fn stop_sent(&mut self, cpu: Cpu) {
        self.stopped_at = None;
        cpu.set_bits(self.registers.twcr, TWSTO, false);
    }

    /// The TWSTO that the program wrote asks for a STOP.
    pub fn forget_stop(&mut self) {
        self.stopped_at = None;
    }

    /// The bus has noticed that the node left at this cycle, or gave up its role by TWSTO.
    pub fn has_left(&mut self, cpu: Cpu, at: u64) {
        if self.stopped_at == Some(at) {
            return self.stop_sent(cpu);
        }
        self.left_at = None;
        self.release_clock(at);
    }

    fn set_status(&self, cpu: Cpu, status: u8) {
        let prescaler = cpu.data(self.registers.twsr) & !STATUS;
        cpu.set_data(self.registers.twsr, status | prescaler);
    }

    // --- What the program writes ----------------------------------------------------------------

    fn write_control(&mut self, cpu: Cpu, value: u8) {
        let before = self.control(cpu);
        let held = before & TWINT & !value;
        let now = value & (TWEA | TWSTA | TWSTO | TWEN | TWIE) | before & TWWC | held;
        cpu.set_data(self.registers.twcr, now);
        if now & TWEN == 0 {
            cpu.set_bits(self.registers.twcr, TWINT | TWSTO, false);
            self.set_status(cpu, NO_STATUS);
            if before & TWEN != 0 {
                self.leave(cpu);
            }
            return;
        }
        let released = self.holds_clock && held == 0;
        if released {
            self.set_status(cpu, NO_STATUS);
            self.release_clock(cpu.cycle());
            self.command = now;
            self.bit = self.next_bit(cpu);
        }
        let newly_asked = before & (TWEN | TWSTA) != TWEN | TWSTA;
        if now & TWSTA != 0 && (released || newly_asked) {
            self.start_asked_at = cpu.cycle();
            self.start_bit = self.next_bit(cpu);
        }
        if now & TWSTO != 0 {
            self.stopped_at = Some(cpu.cycle());
        }
        interrupt::refresh(cpu, self.vector);
        cpu.call_attention();
    }

    /// Sets a register that decides the length of a bit. A shorter one is not used at once, for other nodes
    /// may have run as far ahead as the longer one allowed.
    fn set_rate(&mut self, cpu: Cpu, register: u16, value: u8) {
        let (before, used) = (self.bit_cycles(cpu), self.next_bit(cpu));
        cpu.set_data(register, value);
        if self.bit_cycles(cpu) < before {
            self.longer_bit = (used, cpu.cycle() + START_AND_ADDRESS_BITS * used);
        }
    }

    /// Length of a bit in cycles for what the program asks for now.
    fn next_bit(&self, cpu: Cpu) -> u64 {
        let (bit, until) = self.longer_bit;
        let at_least = if cpu.cycle() < until { bit } else { 0 };
        self.bit_cycles(cpu).max(at_least)
    }

    /// TWDR can be written only while TWINT is set. Otherwise the write is lost, and TWWC is set.
    fn write_data(&mut self, cpu: Cpu, value: u8) {
        let writable = self.control(cpu) & TWINT != 0;
        if writable {
            cpu.set_data(self.registers.twdr, value);
        }
        cpu.set_bits(self.registers.twcr, TWWC, !writable);
    }
}

impl Device for Twi {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        cpu.tell(News::Bus);
        if address == self.registers.twcr {
            self.write_control(cpu, value);
        } else if address == self.registers.twdr {
            self.write_data(cpu, value);
        } else if address == self.registers.twsr {
            let status = cpu.data(address) & STATUS;
            self.set_rate(cpu, address, status | value & !STATUS);
            cpu.call_attention();
        } else {
            self.set_rate(cpu, address, value); // TWBR
            cpu.call_attention();
        }
    }
}
