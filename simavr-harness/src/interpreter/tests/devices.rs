//! Runs programs that use all devices, interrupts and sleep, with events from outside, on both interpreters.

use std::sync::Arc;

use simulation::Random;

use crate::character::Character;
use crate::cpu::Reset;
use crate::image::Image;
use crate::mcu::Mcu;
use crate::part::{Part, Pin};

use super::LDS;

const NOP: u16 = 0x0000;
const SEI: u16 = 0x9478;
const CLI: u16 = 0x94f8;
const SLEEP: u16 = 0x9588;
const WDR: u16 = 0x95a8;
const RETI: u16 = 0x9518;
const JMP: u16 = 0x940c;
const LDI_R20: u16 = 0xe040;
const STS_R20: u16 = 0x9340;
const SBI: u16 = 0x9a00;
const CBI: u16 = 0x9800;
const SBIS: u16 = 0x9b00;
const SBIC: u16 = 0x9900;
const ADD: u16 = 0x0c00;
const CPSE: u16 = 0x1000;

/// Data addresses of the stack pointer.
const SP: [u16; 2] = [0x5d, 0x5e];
/// Data addresses of Timer0's control register, and of the interrupt mask of Timer0 to Timer2.
const TCCR0: u16 = 0x53;
const TIMSK: u16 = 0x57;
/// Data addresses of the registers that choose the sleep mode, divide the clock and begin self-programming.
const MCUCR: u16 = 0x55;
const XDIV: u16 = 0x5c;
const SPMCSR: u16 = 0x68;
/// Those of Timer0's crystal, of special functions, of the comparator and of the USARTs.
const ASSR: u16 = 0x50;
const SFIOR: u16 = 0x40;
const ACSR: u16 = 0x28;
const UCSR0A: u16 = 0x2b;
const UCSR0B: u16 = 0x2a;
const UCSR0C: u16 = 0x95;
const UCSR1A: u16 = 0x9b;
const UCSR1B: u16 = 0x9a;
const UCSR1C: u16 = 0x9d;
/// Data addresses of the registers of devices, and of the status register.
const DEVICES: std::ops::Range<u16> = 0x20..0xa0;
/// The ATmega128's vectors.
const VECTORS: u16 = 35;
/// Where handlers begin, and the distance between two of them, in words.
const HANDLERS: usize = 0x200;
const APART: usize = 0x40;
const NUMBER: usize = 8;

/// A random program, drawn word by word.
struct Program {
    random: Random,
    words: Vec<u16>,
}

impl Program {
    fn draw(seed: u64) -> Vec<u8> {
        let mut program = Program { random: Random::new(seed), words: Vec::new() };
        program.jump(usize::from(2 * VECTORS));
        for _ in 1..VECTORS {
            let handler = program.random.below(NUMBER);
            program.jump(HANDLERS + handler * APART);
        }
        program.store(SP[1], 0x10);
        program.store(SP[0], 0xff);
        program.store(TIMSK, 0xff);
        let prescaler = program.random.below(8) as u8;
        program.store(TCCR0, 0x08 | prescaler); // cleared at a match
        let begin = program.words.len();
        while program.words.len() < HANDLERS - 8 {
            program.add(&[&[NOP], &[SEI], &[CLI, NOP, SEI], &[SEI, SLEEP], &[WDR]]);
        }
        program.jump(begin);
        for handler in 0..NUMBER {
            program.words.resize(HANDLERS + handler * APART, NOP);
            program.words.extend([push(20), read(20, 0x3f), push(20)]);
            for _ in 0..program.random.below(6) {
                program.add(&[&[NOP], &[WDR]]);
            }
            program.words.extend([pop(20), write(0x3f, 20), pop(20), RETI]);
        }
        let mut flash: Vec<u8> = program.words.iter().flat_map(|word| word.to_le_bytes()).collect();
        flash.resize(0x2000, 0);
        flash
    }

    fn jump(&mut self, to: usize) {
        self.words.extend([JMP, to as u16]);
    }

    /// Stores a value, by r20.
    fn store(&mut self, address: u16, value: u8) {
        let value = u16::from(value);
        self.words.extend([LDI_R20 | (value & 0xf0) << 4 | value & 0xf, STS_R20, address]);
    }

    /// A register of a device, or the status register.
    fn register(&mut self) -> u16 {
        let devices = DEVICES.len();
        loop {
            let address = DEVICES.start + self.random.below(devices) as u16;
            if !SP.contains(&address) {
                return address;
            }
        }
    }

    /// Adds one of these instructions, or one that works with a device or with registers.
    fn add(&mut self, others: &[&[u16]]) {
        let [first, second, bit] = [16, 16, 8].map(|below| self.random.below(below) as u16);
        let port = self.random.below(32) as u16;
        let value = self.random.next_u64() as u8;
        match self.random.below(9) {
            0 | 1 => {
                let address = self.register();
                self.store(address, value & !crashing(address));
            }
            2 => {
                let address = self.register();
                self.words.extend([LDS | first << 4, address]);
            }
            3 if crashing(DEVICES.start + port) >> bit & 1 == 0 => {
                self.words.push([SBI, CBI][self.random.below(2)] | port << 3 | bit);
            }
            4 => self.words.extend([[SBIS, SBIC][self.random.below(2)] | port << 3 | bit, NOP]),
            5 => self.words.push(ADD | first << 4 | second),
            6 => self.words.extend([CPSE | first << 4 | second, NOP]),
            _ => self.words.extend(others[self.random.below(others.len())]),
        }
    }
}

const fn push(register: u16) -> u16 {
    0x920f | register << 4
}

const fn pop(register: u16) -> u16 {
    0x900f | register << 4
}

/// From or to a port below 0x40.
const fn read(register: u16, port: u16) -> u16 {
    0xb000 | (port & 0x30) << 5 | register << 4 | port & 0xf
}

const fn write(port: u16, register: u16) -> u16 {
    read(register, port) | 0x0800
}

/// The bits of a register that would crash a program: they ask for what is not simulated.
fn crashing(address: u16) -> u8 {
    match address {
        MCUCR => 0x9e,
        XDIV => 0x80,
        SPMCSR => 0x01,
        ASSR => 0x08,
        SFIOR => 0x8c,
        ACSR => 0x4c,
        UCSR0A | UCSR1A => 0x01,
        UCSR0B | UCSR1B => 0x04,
        UCSR0C | UCSR1C => 0xc0,
        _ => 0,
    }
}

/// Applies a random event from outside: a reset, a character or a level at a pin.
fn come(random: &mut Random, mcus: &mut [Mcu]) {
    let [kind, usart, bit] = [20, 2, 8].map(|below| random.below(below));
    let port = ['A', 'B', 'D', 'E', 'F'][random.below(5)];
    let length = [100, 1600, 4160][random.below(3)];
    let (value, level) = (random.next_u64() as u8, random.chance(0.5));
    for mcu in mcus {
        let start = mcu.cycle();
        match kind {
            0 => mcu.reset(Reset::External),
            1..10 => mcu.receive(usart, Character { value, start, end: start + length }),
            _ => mcu.drive_pin(Pin { port, bit: bit as u8 }, level),
        }
    }
}

#[test]
fn programs_with_devices_run_as_in_simavr() {
    let (mut awake, mut cycles) = (0, 0);
    for number in 0..200 {
        let flash = Program::draw(number);
        let mut random = Random::new(!number);
        let mut mcus = [true, false].map(|decoded| {
            let image = Arc::new(Image::of_flash(flash.clone(), decoded));
            Mcu::new(Part::ATMEGA128, image, number).expect("the image fits")
        });
        while mcus[0].is_alive() && mcus[0].cycle() < 60_000 {
            let until = mcus[0].cycle() + 1 + random.next_u64() % 3000;
            let [ours, simavrs] = mcus.each_mut().map(|mcu| {
                mcu.run_until(until);
                let sent = [0, 1].map(|usart| mcu.take_sent(usart));
                (mcu.state(), mcu.awake_cycles(), mcu.resets(), mcu.state_hash(), mcu.take_markers(), sent)
            });
            assert_eq!(ours, simavrs, "program {number} at {until}");
            come(&mut random, &mut mcus);
        }
        assert_eq!(mcus[0].eeprom(), mcus[1].eeprom(), "program {number}");
        awake += mcus[0].awake_cycles();
        cycles += mcus[0].cycle();
    }
    assert!(cycles > 200 * 50_000, "they end at once: {cycles}");
    assert!((cycles / 4..cycles / 4 * 3).contains(&awake), "they sleep, or don't: {awake} of {cycles}");
}
