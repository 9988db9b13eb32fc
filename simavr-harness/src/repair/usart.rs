//! A USART in asynchronous mode (chapter "USART"), in place of simavr's. A frame takes its true
//! time, the transmitter has a buffer before its shift register, TXC is set once when both are
//! empty, and the receiver has two bytes of buffer and its shift register.
//!
//! Bytes come and go as [`Character`]s with the cycles of their frame, so that the code that joins two
//! USARTs can deliver a byte at the end of its frame. That code also decides whether a module hears its own
//! transmission.
//!
//! Simplified: an overrun, which happens at the start bit of the frame that is too many, shows at the end
//! of that frame. What the program has read meanwhile can't be lost any more, so the new frame is lost in
//! its place. Parity is never wrong. A character of another length than the receiver's frames is taken to
//! have 8 data bits and one stop bit, and what it leads to beyond the first frame is not received.

use std::collections::VecDeque;

use crate::character::Character;
use crate::cpu::{Cpu, News, Vector};
use crate::device::{Attached, Device, make_plain};
use crate::part::UsartRegisters;
use crate::repair::incoming::{Frame, Incoming, is_high};
use crate::repair::interrupt;

/// The counts of a USART since power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UsartCounts {
    /// Characters sent.
    pub sent: u64,
    /// Characters that came while the receiver was on.
    pub received: u64,
    /// The received characters that were lost because the buffer and the shift register were full.
    pub overrun: u64,
    /// Characters that came while the receiver was off.
    pub unheard: u64,
}

pub(crate) struct Usart {
    registers: &'static UsartRegisters,
    vectors: Vectors,
    transmitter: Transmitter,
    receiver: Receiver,
    counts: UsartCounts,
}

struct Vectors {
    receive_complete: Vector,
    data_register_empty: Vector,
    transmit_complete: Vector,
}

#[derive(Default)]
struct Transmitter {
    buffer: Option<u8>,
    /// End of the frame in the shift register.
    shifting_until: Option<u64>,
    /// Characters begun since they were last taken.
    sent: Vec<Character>,
}

#[derive(Default)]
struct Receiver {
    incoming: Incoming,
    /// Two bytes of buffer, then the shift register.
    held: VecDeque<Received>,
    /// The cycle at which the receiver was switched on. It does not hear a frame that has begun before.
    on_since: u64,
    /// The cycle at which the program last made room where there was none.
    room_since: u64,
}

/// A byte that was received.
#[derive(Clone, Copy)]
struct Received {
    value: u8,
    has_framing_error: bool,
}

/// The receive buffer and the shift register behind it.
const RECEIVER_HOLDS: usize = 3;

// UCSRnA
const RXC: u8 = 0x80;
const TXC: u8 = 0x40;
const UDRE: u8 = 0x20;
const FE: u8 = 0x10;
const DOR: u8 = 0x08;
const U2X: u8 = 0x02;
const MPCM: u8 = 0x01;
// UCSRnB
const RXEN: u8 = 0x10;
const TXEN: u8 = 0x08;
const UCSZ2: u8 = 0x04;
// UCSRnC
/// UMSELn, which is two bits on later parts; the upper one is reserved on the ATmega128.
const SYNCHRONOUS: u8 = 0xc0;
const EIGHT_BITS: u8 = 0x06;

/// Replaces simavr's USART by the harness's. `None`: the part has no such vectors.
pub(crate) fn attach(cpu: Cpu, registers: &'static UsartRegisters) -> Option<Attached<Usart>> {
    let &UsartRegisters { udr, ucsra, ucsrb, ucsrc, ubrrl, ubrrh, .. } = registers;
    let vectors = Vectors {
        receive_complete: cpu.vector(registers.receive_complete)?,
        data_register_empty: cpu.vector(registers.data_register_empty)?,
        transmit_complete: cpu.vector(registers.transmit_complete)?,
    };
    make_plain(cpu, &[ucsra, ucsrb, ucsrc, ubrrl, ubrrh]);
    let usart = Usart {
        registers,
        vectors,
        transmitter: Transmitter::default(),
        receiver: Receiver::default(),
        counts: UsartCounts::default(),
    };
    Some(Attached::new(cpu, usart, &[udr, ucsra, ucsrb, ucsrc], &[udr]))
}

impl Receiver {
    /// Drops what has come in. Characters on the wire stay there.
    fn flush(&mut self) {
        self.held.clear();
        self.room_since = 0;
    }
}

impl UsartRegisters {
    /// Length of a frame in cycles by the present registers: start bit, data bits, parity, stop bits (section
    /// "Frame Formats").
    pub fn frame_cycles(&self, cpu: Cpu) -> u64 {
        let stop_bits = if cpu.data(self.ucsrc) & 0x08 == 0 { 1 } else { 2 };
        (1 + self.data_bits(cpu) + self.parity_bits(cpu) + stop_bits) * self.bit_cycles(cpu)
    }

    /// 5 to 9.
    fn data_bits(&self, cpu: Cpu) -> u64 {
        let nine_bits = cpu.data(self.ucsrb) & UCSZ2 != 0;
        if nine_bits { 9 } else { 5 + u64::from(cpu.data(self.ucsrc) >> 1 & 3) }
    }

    /// The bits of a byte that a frame has.
    fn data(&self, cpu: Cpu, value: u8) -> u8 {
        let left_out = 8_u64.saturating_sub(self.data_bits(cpu));
        value & u8::MAX >> left_out
    }

    fn parity_bits(&self, cpu: Cpu) -> u64 {
        u64::from(cpu.data(self.ucsrc) & 0x30 != 0)
    }

    fn bit_cycles(&self, cpu: Cpu) -> u64 {
        let divisor = u16::from_le_bytes([cpu.data(self.ubrrl), cpu.data(self.ubrrh) & 0x0f]);
        let double_speed = cpu.data(self.ucsra) & U2X != 0;
        (if double_speed { 8 } else { 16 }) * (u64::from(divisor) + 1)
    }

    /// What the receiver makes of a frame, in which characters may overlap, and whose bits may be longer or
    /// shorter than its own: it reads the line in the middle of each of its own bits.
    fn hear<'a>(
        &self,
        cpu: Cpu,
        Frame { start, end }: Frame,
        characters: impl Iterator<Item = &'a Character> + Clone,
    ) -> Received {
        let length = end.saturating_sub(start).max(1);
        let mut alone = characters.clone();
        if let (Some(character), None) = (alone.next(), alone.next())
            && character.start == start
            && self.frame_cycles(cpu).abs_diff(length) * 50 <= length
        {
            return Received { value: self.data(cpu, character.value), has_framing_error: false };
        }
        let bit_cycles = self.bit_cycles(cpu);
        let level_in_bit = |bit: u64| is_high(characters.clone(), start + (2 * bit + 1) * bit_cycles / 2);
        let data_bits = self.data_bits(cpu);
        let value =
            (0..data_bits.min(8)).fold(0, |value, bit| value | u8::from(level_in_bit(bit + 1)) << bit);
        let stop_bit = 1 + data_bits + self.parity_bits(cpu);
        Received { value, has_framing_error: !level_in_bit(stop_bit) }
    }

    pub fn transmitter_is_on(&self, cpu: Cpu) -> bool {
        cpu.data(self.ucsrb) & TXEN != 0
    }
}

impl Usart {
    /// Sets the registers to their values after a reset. Characters on the wire stay there.
    pub fn reset(&mut self, cpu: Cpu) {
        self.transmitter.buffer = None;
        self.transmitter.shifting_until = None;
        self.receiver.flush();
        cpu.set_data(self.registers.ucsra, UDRE);
        cpu.set_data(self.registers.ucsrb, 0);
        cpu.set_data(self.registers.ucsrc, EIGHT_BITS);
        self.refresh(cpu);
    }

    /// Whether there are characters to be taken.
    pub fn has_sent(&self) -> bool {
        !self.transmitter.sent.is_empty()
    }

    /// Takes the characters whose frames began since the last call, in order.
    pub fn take_sent(&mut self) -> Vec<Character> {
        std::mem::take(&mut self.transmitter.sent)
    }

    /// Delivers a character, which the USART receives at the end of its frame.
    pub fn receive(&mut self, character: Character) {
        self.receiver.incoming.push(character);
    }

    pub fn counts(&self) -> UsartCounts {
        self.counts
    }

    fn receiver_is_on(&self, cpu: Cpu) -> bool {
        cpu.data(self.registers.ucsrb) & RXEN != 0
    }

    fn set_status(&self, cpu: Cpu, bits: u8, on: bool) {
        cpu.set_bits(self.registers.ucsra, bits, on);
    }

    fn refresh(&self, cpu: Cpu) {
        let Vectors { receive_complete, data_register_empty, transmit_complete } = self.vectors;
        for vector in [receive_complete, data_register_empty, transmit_complete] {
            interrupt::refresh(cpu, vector);
        }
    }

    /// Moves the buffered byte to the idle shift register.
    fn shift_out(&mut self, cpu: Cpu, start: u64) {
        let Some(value) = self.transmitter.buffer.take() else { return };
        let value = self.registers.data(cpu, value);
        let end = start + self.registers.frame_cycles(cpu);
        self.transmitter.shifting_until = Some(end);
        self.transmitter.sent.push(Character { value, start, end });
        cpu.tell(News::Sent);
        self.counts.sent += 1;
        self.set_status(cpu, UDRE, true);
    }

    fn end_of_sent_frame(&mut self, cpu: Cpu, now: u64) {
        self.transmitter.shifting_until = None;
        if self.transmitter.buffer.is_some() {
            self.shift_out(cpu, now);
        } else {
            self.set_status(cpu, TXC, true);
        }
    }

    fn end_of_received_frame(&mut self, cpu: Cpu, frame: Frame) {
        let start = frame.start;
        if !self.receiver_is_on(cpu) || start < self.receiver.on_since {
            self.counts.unheard += 1;
            return;
        }
        self.counts.received += 1;
        if self.receiver.held.len() == RECEIVER_HOLDS || start < self.receiver.room_since {
            self.set_status(cpu, DOR, true);
            self.counts.overrun += 1;
            // The new byte was shifted in over the one that waited in the shift register.
            if self.receiver.held.pop_back().is_none() {
                return;
            }
        }
        let heard = self.registers.hear(cpu, frame, self.receiver.incoming.of(frame));
        self.receiver.held.push_back(heard);
        self.show_received(cpu);
    }

    /// Shows whether a byte waits, and whether the first one that does had a framing error.
    fn show_received(&self, cpu: Cpu) {
        let first = self.receiver.held.front();
        self.set_status(cpu, RXC, first.is_some());
        self.set_status(cpu, FE, first.is_some_and(|byte| byte.has_framing_error));
    }

    fn write_data(&mut self, cpu: Cpu, value: u8) {
        if !self.registers.transmitter_is_on(cpu) || self.transmitter.buffer.is_some() {
            return;
        }
        self.transmitter.buffer = Some(value);
        if self.transmitter.shifting_until.is_none() {
            self.shift_out(cpu, cpu.cycle());
        } else {
            self.set_status(cpu, UDRE, false);
        }
    }

    fn write_status(&mut self, cpu: Cpu, value: u8) {
        if value & MPCM != 0 {
            cpu.report("MPCM set in UCSRA: frames with addresses are not simulated");
        }
        let kept = cpu.data(self.registers.ucsra) & !(U2X | MPCM) & !(value & TXC);
        cpu.set_data(self.registers.ucsra, kept | value & (U2X | MPCM));
    }

    fn write_format(&self, cpu: Cpu, value: u8) {
        if value & SYNCHRONOUS != 0 {
            cpu.report("UMSEL set in UCSRC: a synchronous USART is not simulated");
        }
        cpu.set_data(self.registers.ucsrc, value);
    }

    fn write_control(&mut self, cpu: Cpu, value: u8) {
        if value & UCSZ2 != 0 {
            cpu.report("UCSZ2 set in UCSRB: a ninth data bit is not simulated");
        }
        let was_on = self.receiver_is_on(cpu);
        cpu.set_data(self.registers.ucsrb, value);
        if value & RXEN == 0 {
            self.receiver.flush();
            self.set_status(cpu, RXC | FE | DOR, false);
        } else if !was_on {
            self.receiver.on_since = cpu.cycle();
        }
    }
}

impl Device for Usart {
    fn write(&mut self, cpu: Cpu, address: u16, value: u8) {
        if address == self.registers.udr {
            self.write_data(cpu, value);
        } else if address == self.registers.ucsra {
            self.write_status(cpu, value);
        } else if address == self.registers.ucsrc {
            self.write_format(cpu, value);
        } else {
            self.write_control(cpu, value);
        }
        self.refresh(cpu);
    }

    fn read(&mut self, cpu: Cpu, _udr: u16) -> u8 {
        if self.receiver.held.len() == RECEIVER_HOLDS {
            self.receiver.room_since = cpu.cycle();
        }
        let byte = self.receiver.held.pop_front();
        self.set_status(cpu, DOR, false);
        self.show_received(cpu);
        self.refresh(cpu);
        byte.map_or(0, |byte| byte.value)
    }

    fn due(&self) -> Option<u64> {
        let arrival = self.receiver.incoming.next().map(|frame| frame.end);
        [self.transmitter.shifting_until, arrival].into_iter().flatten().min()
    }

    fn expire(&mut self, cpu: Cpu, now: u64) {
        if self.transmitter.shifting_until == Some(now) {
            self.end_of_sent_frame(cpu, now);
        }
        if let Some(frame) = self.receiver.incoming.next().filter(|frame| frame.end == now) {
            self.end_of_received_frame(cpu, frame);
            self.receiver.incoming.read(frame);
        }
        self.refresh(cpu);
    }
}
